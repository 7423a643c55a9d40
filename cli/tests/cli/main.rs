//! The program, as a user calls it.

#![allow(clippy::unwrap_used)] // helpers of tests

mod aliases;
mod bad_car;
mod bad_files;
mod bad_input;
mod believed;
mod broken_logs;
mod broken_on_purpose;
mod check_all;
mod cluster;
mod common;
mod compare;
mod draw;
mod drive_walk;
mod export;
#[cfg(unix)]
mod external;
#[cfg(unix)]
mod foreign;
#[cfg(unix)]
mod four_ways;
mod hardened;
mod help;
mod kinds;
mod last_line;
mod logs_and_runs;
mod long_runs;
mod map;
mod mutants;
mod new_estimator;
mod nothing_lost;
mod own_command;
mod replay;
mod reports;
mod results;
mod runs;
mod schema;
mod stress;
mod stress_drawn;
mod studies;
#[cfg(unix)]
mod trust;
mod tune;
#[cfg(unix)]
mod tune_interrupted;
mod tutorial;
mod verdicts;
mod without_viewer;
