//! The trait of every estimator.

use crate::Real;
use crate::api::{
    error::Error,
    signals::{Command, Estimate, Measurements},
};

/// An estimator of mass and slope.
pub trait Estimator {
    /// One step of `dt` seconds with the samples that came since the last one. On an error the estimator is as it was.
    fn step(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Estimate, Error>;

    /// Back to the state it was built in.
    fn reset(&mut self);

    /// Names of its internal quantities, for plots.
    fn internals(&self) -> &'static [&'static str];

    /// Writes the internal quantities, in the order of their names, into `values`; as many as fit.
    fn internal_values(&self, values: &mut [Real]);
}
