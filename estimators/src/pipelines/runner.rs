//! What every pipeline gets for free: checked input, all-or-nothing steps, reset.

use core::fmt;

use crate::api::estimator::Estimator;
use crate::api::signals::{Command, Estimate, Measurements, Vehicle};
use crate::api::snapshot::{Archive, Fingerprint, SnapshotError, State};
use crate::preprocess::front_end::{FrontEnd, Reading};
use crate::{Error, Real, Time};

/// The work of a pipeline, once its input is checked and merged. Plain data: a copy is a snapshot.
pub trait Pipeline: Copy {
    /// Names of its internal quantities.
    const INTERNALS: &'static [&'static str];

    /// One step at the instant `t_s` after `dt` seconds.
    fn advance(&mut self, reading: &Reading, t_s: Time, dt: Real) -> Estimate;

    /// Its internal quantities, in the order of their names, written to `values`; as many as fit.
    fn internal_values(&self, values: &mut [Real]);

    /// Its state, for a snapshot. A pipeline that does not say keeps none.
    fn visit(&mut self, archive: &mut Archive) {
        archive.refuse(SnapshotError::NotKept);
    }
}

/// A pipeline made an estimator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Runner<P> {
    front_end: FrontEnd,
    now: P,
    start: (FrontEnd, P),
}

impl<P: Pipeline> Runner<P> {
    /// Hosts `pipeline`, built for `vehicle`.
    pub fn new(vehicle: &Vehicle, pipeline: P) -> Self {
        let front_end = FrontEnd::new(vehicle);
        Self {
            front_end,
            now: pipeline,
            start: (front_end, pipeline),
        }
    }
}

impl<P: Pipeline + fmt::Debug> Runner<P> {
    /// What it was built with: vehicle, parameters, and how this version keeps them.
    pub(crate) fn fingerprint(&self) -> u64 {
        Fingerprint::of(&self.start)
    }
}

impl<P: Pipeline> State for Runner<P> {
    fn visit(&mut self, archive: &mut Archive) {
        self.front_end.visit(archive);
        self.now.visit(archive);
    }
}

impl<P: Pipeline> Estimator for Runner<P> {
    fn step(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Estimate, Error> {
        let before = (self.front_end, self.now);
        let reading = self.front_end.read(z, u, dt)?;
        let estimate = self.now.advance(&reading, z.t_s, dt);
        if !estimate.is_finite() {
            (self.front_end, self.now) = before;
            return Err(Error::Diverged);
        }
        Ok(estimate)
    }

    fn reset(&mut self) {
        (self.front_end, self.now) = self.start;
    }

    fn internals(&self) -> &'static [&'static str] {
        P::INTERNALS
    }

    fn internal_values(&self, values: &mut [Real]) {
        self.now.internal_values(values);
    }
}

/// Copies as much of `from` as fits.
pub fn copy_into(values: &mut [Real], from: &[Real]) {
    for (place, value) in values.iter_mut().zip(from) {
        *place = *value;
    }
}
