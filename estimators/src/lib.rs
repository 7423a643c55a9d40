//! monorig-estimators: what would be flashed on the vehicle.
//!
//! `no_std`, no allocation, no panic, no NaN: every algorithm estimates the load mass of a monorail crane and the slope
//! under it from motor torque, wheel speed and an IMU.
//!
//! - [`api`]: what crosses the border: signals in, estimates out, parameters, errors, snapshots
//! - [`filters`]: algorithms, one a file; none knows what a crane is
//! - [`preprocess`], [`models`], [`mass`], [`grade`]: from samples to signals, the force balance and the rail, first and second stages
//! - [`pipelines`]: whole estimators, put together from stages; [`registry`] builds them by name
//! - with the feature `printed`, `published`: the published methods letter by letter, errata and all
//!
//! Notation used in filter code: `x` state, `P` covariance, `F` transition Jacobian, `H` measurement Jacobian,
//! `Q` process noise, `R` measurement noise, `y` innovation, `S` innovation covariance, `K` gain,
//! `lambda` forgetting factor, `theta` grade angle (+ uphill in the direction of growing chainage).
#![no_std]
#![forbid(unsafe_code)]
#![allow(non_snake_case)]
#![cfg_attr(feature = "f32", allow(clippy::excessive_precision))] // constants are written out for both scalars
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

pub mod api;
pub mod filters;
pub mod grade;
pub mod mass;
pub mod models;
pub mod pipelines;
pub mod preprocess;
#[cfg(feature = "printed")]
pub mod published;
pub mod registry;
pub mod supervise;

#[cfg(test)]
mod behaviour;
#[cfg(test)]
mod testing;

pub use api::aid::{AidOutcome, AidStatus, Rejection};
pub use api::error::Error;
pub use api::estimator::{Estimator, Internal};
pub use api::params::{ParamError, Parameters, Setting};
pub use api::signals::{Command, Estimate, Flags, MAX_DRIVES, Measurements, Sample, Value};
pub use api::snapshot::SnapshotError;
pub use api::time::Time;
pub use api::vehicle::{RoadVehicle, Vehicle, VehicleData};

/// The scalar of every estimator: double precision, or single with the feature `f32`.
#[cfg(not(feature = "f32"))]
pub type Real = f64;

/// The scalar of every estimator: single precision.
#[cfg(feature = "f32")]
pub type Real = f32;
