//! Common frame of every pipeline: checked input, a new start after a step that diverges, reset.

use crate::api::aid::AidStatus;
pub(crate) use crate::api::estimator::copy_into;
use crate::api::estimator::{Estimator, Internal};
use crate::api::fingerprint::Fingerprint;
use crate::api::params::Parameters;
use crate::api::reading::Reading;
use crate::api::signals::{Command, Estimate, Measurements};
use crate::api::snapshot::{self, Archive, Origin, SnapshotError, State};
use crate::api::vehicle::Vehicle;
use crate::preprocess::conditioning::ConditioningParams;
use crate::preprocess::front_end::FrontEnd;
use crate::{Error, Real, Time};

/// The work of a pipeline after its input has been checked and merged. Plain data.
pub trait Pipeline: Copy {
    /// Names of its internal quantities.
    const INTERNALS: &'static [Internal];

    /// One step at the instant `t` after `dt` seconds.
    fn advance(&mut self, reading: &Reading, t: Time, dt: Real) -> Estimate;

    /// Its internal quantities, in the order of their names, written to `values`; as many as fit.
    fn internal_values(&self, values: &mut [Real]);

    /// Conditioning of the pipeline's channels; a published method has none.
    fn conditioning(&self) -> Option<ConditioningParams> {
        None
    }

    /// Sources of measurements that the pipeline uses.
    const AID_SOURCES: &'static [&'static str] = &[];

    /// Writes the status of the last measurement of each source to `status`; as many as fit.
    fn aid_status(&self, _status: &mut [AidStatus]) {}

    /// Its state, for a snapshot. A pipeline without this method keeps none.
    fn visit(&mut self, archive: &mut Archive) {
        archive.refuse(SnapshotError::NotKept);
    }
}

/// A pipeline as an estimator.
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

    /// Fingerprints of the name, and of vehicle and parameters; also of version and size, which may change the meaning
    /// of the state.
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

/// Functions for a search for parameters. The same name, vehicle, parameters and state.
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
        let reading = self.signals.read(z, u, dt)?;
        let estimate = self.pipeline.advance(&reading, z.t, dt);
        if !estimate.is_finite() {
            // The state may be of no use for long already; to keep it would mean to diverge again and again.
            self.reset();
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

/// Front end for a pipeline.
fn front_end<P: Pipeline>(pipeline: &P, vehicle: &Vehicle) -> FrontEnd {
    match pipeline.conditioning() {
        Some(params) => FrontEnd::conditioned(vehicle, params),
        None => FrontEnd::new(vehicle),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Time;
    use crate::api::params::params;
    use crate::testing::vehicles::vehicle;

    params! {
        /// None that counts.
        None_ { gain ["-"] = 1.0, 0.0 => 1.0, "Of no use."; }
    }

    /// Counts its steps; the mean torque of the motors is its estimate, and a step without one is none of a number.
    #[derive(Clone, Copy, Debug, PartialEq)]
    struct Counter(u32);

    impl Pipeline for Counter {
        const INTERNALS: &'static [Internal] = &[];

        fn advance(&mut self, reading: &Reading, t: Time, _: Real) -> Estimate {
            self.0 += 1;
            let mut estimate = Estimate::at(t);
            estimate.total_mass_kg.value = reading.motor_torque_nm.unwrap_or(Real::NAN);
            estimate
        }

        fn internal_values(&self, _: &mut [Real]) {}
    }

    /// A refused input changes nothing; after a step that diverges the estimator is as it was built, and goes on.
    #[test]
    fn a_step_that_diverges_starts_anew_and_one_refused_changes_nothing() {
        let built = Runner::new(
            "counter",
            |_, _: &None_| Counter(0),
            &vehicle(),
            &None_::default(),
        );
        let (mut runner, u) = (built, Command::default());
        let with_torque = |t_s: f64, value: Real| {
            let mut z = Measurements::at(Time::from_s(t_s));
            let sample = crate::Sample { t: z.t, value };
            z.motor_torque_nm = [Some(sample); crate::api::signals::MAX_DRIVES];
            z
        };
        for t_s in [1.0, 1.01] {
            runner
                .step(&with_torque(t_s, t_s as Real), &u, 0.01)
                .unwrap();
        }
        let before = runner;
        let refused = runner.step(&with_torque(1.02, Real::NAN), &u, 0.01);
        assert_eq!(refused, Err(Error::NotFinite("motor torque")));
        assert!(runner == before && runner != built && runner.pipeline == Counter(2));
        let nothing = Measurements::at(Time::from_s(2.0));
        assert_eq!(runner.step(&nothing, &u, 0.01), Err(Error::Diverged));
        assert!(runner == built);
        assert!(runner.step(&with_torque(2.01, 1.0), &u, 0.01).is_ok());
    }
}
