//! The FMUs of ours.

#![allow(clippy::unwrap_used)] // helpers of tests

mod common;
#[cfg(target_os = "linux")]
mod instances;
mod plant;
mod there_and_back;
