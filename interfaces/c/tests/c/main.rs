//! `monorig_estimator.h` and the library behind it.

#![allow(clippy::unwrap_used)] // helpers of tests

mod header;
#[cfg(unix)]
mod layout;
#[path = "../../../fmu/tests/fmu/common/steps.rs"]
#[allow(dead_code)] // the tests of the FMUs use the rest
mod steps;
