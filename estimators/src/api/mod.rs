//! Interface of the crate: signals in, estimates out, parameters, errors, snapshots.

pub mod aid;
pub mod error;
pub mod estimator;
pub(crate) mod fingerprint;
pub mod mass_layout;
pub(crate) mod measurements;
pub mod params;
pub(crate) mod reading;
pub mod real;
pub mod signals;
pub mod snapshot;
pub mod text;
pub mod time;
pub mod tolerances;
pub(crate) mod vehicle;
