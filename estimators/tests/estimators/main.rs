//! The estimators, as a program that uses the crate sees them.

#![allow(clippy::unwrap_used)] // helpers of tests

mod closure;
mod common;
mod consistency;
mod fusion;
mod fusion_drive;
mod identifiability;
mod mirror;
mod oracle;
#[cfg(feature = "printed")]
mod pipelines;
#[cfg(feature = "printed")]
mod printed;
mod rail_fusion;
mod recording;
mod reference;
mod robust;
mod single_precision;
mod snapshot;
mod supervision;
mod survey;
mod unread_rail;
mod wrong_imu;
