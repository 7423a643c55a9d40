//! Common frame of every pipeline: checked input, all-or-nothing steps, reset.

use crate::api::aid::AidStatus;
pub(crate) use crate::api::estimator::copy_into;
use crate::api::estimator::{Estimator, Internal};
use crate::api::fingerprint::Fingerprint;
use crate::api::params::Parameters;
use crate::api::signals::{Command, Estimate, Measurements};
use crate::api::snapshot::{self, Archive, Origin, SnapshotError, State};
use crate::api::vehicle::Vehicle;
use crate::preprocess::conditioning::ConditioningParams;
use crate::preprocess::front_end::{FrontEnd, Reading};
use crate::{Error, Real, Time};

/// The work of a pipeline, once its input is checked and merged. Plain data.
pub trait Pipeline: Copy {
    /// Names of its internal quantities.
    const INTERNALS: &'static [Internal];

    /// One step at the instant `t` after `dt` seconds.
    fn advance(&mut self, reading: &Reading, t: Time, dt: Real) -> Estimate;

    /// Its internal quantities, in the order of their names, written to `values`; as many as fit.
    fn internal_values(&self, values: &mut [Real]);

    /// Conditioning of its channels; a published method has none.
    fn conditioning(&self) -> Option<ConditioningParams> {
        None
    }

    /// Sources of measurements it uses.
    const AID_SOURCES: &'static [&'static str] = &[];

    /// Writes the status of the last measurement of each source to `status`; as many as fit.
    fn aid_status(&self, _status: &mut [AidStatus]) {}

    /// Its state, for a snapshot. A pipeline without this method keeps none.
    fn visit(&mut self, archive: &mut Archive) {
        archive.refuse(SnapshotError::NotKept);
    }
}

/// A pipeline made an estimator.
#[derive(Clone, Copy, Debug)]
pub struct Runner<P, Q> {
    name: &'static str,
    build: fn(&Vehicle, &Q) -> P,
    vehicle: Vehicle,
    params: Q,
    signals: FrontEnd,
    pipeline: P,
}

impl<P: Pipeline, Q: Parameters + Copy> Runner<P, Q> {
    /// Builds a pipeline by its `new`, under the name that its snapshots carry.
    pub fn new(
        name: &'static str,
        build: fn(&Vehicle, &Q) -> P,
        vehicle: &Vehicle,
        params: &Q,
    ) -> Self {
        let pipeline = build(vehicle, params);
        Self {
            name,
            build,
            vehicle: *vehicle,
            params: *params,
            signals: front_end(&pipeline, vehicle),
            pipeline,
        }
    }

    /// Of the name, and of vehicle and parameters; of the version and size too, as what the state means may change with
    /// them.
    fn origin(&self) -> Origin {
        let mut estimator = Fingerprint::new();
        estimator.add(self.name.as_bytes());
        let mut settings = Fingerprint::new();
        settings.add(env!("CARGO_PKG_VERSION").as_bytes());
        settings.add(&(size_of::<P>() as u64).to_le_bytes());
        self.vehicle.fingerprint(&mut settings);
        settings.parameters(&self.params);
        Origin {
            estimator: estimator.finish(),
            settings: settings.finish(),
        }
    }
}

impl<P, Q> Runner<P, Q> {
    /// Its front end and its pipeline.
    pub(crate) fn parts(&self) -> (&FrontEnd, &P) {
        (&self.signals, &self.pipeline)
    }

    /// Its pipeline, to be stepped without the front end.
    pub(crate) fn pipeline_mut(&mut self) -> &mut P {
        &mut self.pipeline
    }
}

/// The same name, vehicle, parameters and state.
impl<P: PartialEq, Q: PartialEq> PartialEq for Runner<P, Q> {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
            && self.vehicle == other.vehicle
            && self.params == other.params
            && self.signals == other.signals
            && self.pipeline == other.pipeline
    }
}

impl<P: Pipeline, Q> State for Runner<P, Q> {
    fn visit(&mut self, archive: &mut Archive) {
        self.signals.visit(archive);
        self.pipeline.visit(archive);
    }
}

impl<P: Pipeline, Q: Parameters + Copy> Estimator for Runner<P, Q> {
    fn step(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Estimate, Error> {
        let (mut signals, before) = (self.signals.before(), self.pipeline);
        let stamps = self.signals.check(z, u, dt)?;
        let reading = self.signals.take(z, u, dt, stamps, &mut signals);
        let estimate = self.pipeline.advance(reading, z.t, dt);
        if !estimate.is_finite() {
            self.signals.undo(&signals);
            self.pipeline = before;
            return Err(Error::Diverged);
        }
        Ok(estimate)
    }

    fn reset(&mut self) {
        self.pipeline = (self.build)(&self.vehicle, &self.params);
        self.signals = front_end(&self.pipeline, &self.vehicle);
    }

    fn internals(&self) -> &[Internal] {
        P::INTERNALS
    }

    fn internal_values(&self, values: &mut [Real]) {
        self.pipeline.internal_values(values);
    }

    fn aid_sources(&self) -> &[&'static str] {
        P::AID_SOURCES
    }

    fn aid_status(&self, status: &mut [AidStatus]) {
        self.pipeline.aid_status(status);
    }

    fn snapshot(&self, bytes: &mut [u8]) -> Result<usize, SnapshotError> {
        snapshot::write(bytes, &self.origin(), &mut { *self })
    }

    fn restore(&mut self, bytes: &[u8]) -> Result<(), SnapshotError> {
        let mut restored = *self;
        snapshot::read(bytes, &self.origin(), &mut restored)?;
        *self = restored;
        Ok(())
    }
}

/// The front end that a pipeline needs.
fn front_end<P: Pipeline>(pipeline: &P, vehicle: &Vehicle) -> FrontEnd {
    match pipeline.conditioning() {
        Some(params) => FrontEnd::conditioned(vehicle, params),
        None => FrontEnd::new(vehicle),
    }
}
