//! Metrics, verdicts, studies and reports from outside of the crate.

#![allow(clippy::unwrap_used)] // helpers of tests

mod draw;
mod mutants;
mod recordings;
mod report_kit;
mod rooms;
mod run_in_code;
mod stress;
