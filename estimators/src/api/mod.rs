//! What crosses the border of the crate: signals in, estimates out, parameters, errors, snapshots.

pub mod error;
pub mod estimator;
pub mod params;
pub mod real;
pub mod signals;
pub mod snapshot;
