//! `monorig_estimator.h` and the library behind it.

#![allow(clippy::unwrap_used)] // helpers of tests

mod header;
#[cfg(unix)]
mod layout;
#[path = "../../../fmu/tests/fmu/common/steps.rs"]
mod steps;
