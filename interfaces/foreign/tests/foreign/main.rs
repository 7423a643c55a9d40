//! Estimators and controllers of shared libraries and FMUs.

#![allow(clippy::unwrap_used)] // helpers of tests

#[cfg(unix)]
mod common;
#[cfg(unix)]
mod controllers;
#[cfg(unix)]
mod fmus;
#[cfg(unix)]
mod libraries;
