//! Logs read and written.

#![allow(clippy::unwrap_used)] // helpers of tests

mod checks;
mod drive;
mod export;
mod features;
mod formats;
mod identified;
mod mat;
mod mutants;
mod planted;
mod proposals;
mod real;
mod strangers;
