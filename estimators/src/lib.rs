//! monorig-estimators: what would be flashed on the vehicle.
//!
//! `no_std`, no allocation, no panic, no NaN: every algorithm estimates the load mass of a monorail crane and the slope
//! under it from motor torque, wheel speed and an IMU.
//!
//! - algorithms, one a file: [`gaussian`] and its factors [`ud`], [`rls`] with its ways of [`forgetting`], [`ekf`], [`ukf`], [`sage_husa`], [`strong_tracking`], [`imm`], [`conditioning`], [`smoothing`]
//! - the crane: [`crane`], with the force balance, what the pipelines share, one file for each named pipeline, and
//!   construction by name ([`crane::build`])
//! - what crosses the border: [`signals`]
//! - with the feature `printed`: the published methods as printed, slips and all
//!
//! Notation used in filter code: `x` state, `P` covariance, `F` transition Jacobian, `H` measurement Jacobian,
//! `Q` process noise, `R` measurement noise, `y` innovation, `S` innovation covariance, `K` gain,
//! `lambda` forgetting factor, `theta` grade angle (+ uphill in the direction of growing chainage).
#![no_std]
#![forbid(unsafe_code)]
#![allow(non_snake_case)]
#![cfg_attr(
    not(test),
    deny(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::indexing_slicing,
        clippy::unreachable
    )
)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

#[cfg(test)]
extern crate std;

pub mod conditioning;
pub mod crane;
pub mod ekf;
pub mod error;
pub mod forgetting;
pub mod gaussian;
pub mod imm;
#[cfg(feature = "printed")]
pub mod printed;
pub mod real;
pub mod rls;
pub mod sage_husa;
pub mod signals;
pub mod smoothing;
pub mod snapshot;
pub mod strong_tracking;
#[cfg(test)]
mod testing;
pub mod ud;
pub mod ukf;

pub use error::Error;

/// The scalar of every estimator.
pub type Real = f64;
