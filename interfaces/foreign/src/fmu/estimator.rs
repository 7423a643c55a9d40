//! An estimator that is an FMU.

use super::calls::Fmu;
use super::description::Port;
use super::ports::{self, EstimatorPorts};
use super::running::{RunningFmu, SetTo, parameters};
use crate::foreign::checked;
use monorig_estimators::api::signals::{Command, Estimate, Measurements};
use monorig_estimators::api::snapshot::SnapshotError;
use monorig_estimators::{Error, Estimator, Real, Vehicle};
use monorig_sim::closed_loop::registry::{BoxedEstimator, EstimatorType, NamedSettings, Refusal};
use monorig_sim::config::scenario::Settings;
use std::path::Path;

/// The estimator of an FMU, with the names in the settings' map.
pub(crate) fn estimator_of(path: &Path, settings: &Settings) -> Result<EstimatorType, Refusal> {
    let fmu = Fmu::load(path)?;
    if let Some(is) = &settings.is {
        return Err(Refusal::new(
            format!("{} is one estimator, but `is` names `{is}` in it", fmu.at),
            "`fmu` without `is`",
        ));
    }
    let map = settings.map.clone();
    // what `map` has wrong is told before anything is built
    EstimatorPorts::find(fmu, &map)?;
    let open = ports::unconnected(&fmu.description, &map, &ports::estimator_inputs());
    let groups = parameters(fmu, path, "estimator", &map, &open);
    let name = fmu.description.identifier.clone();
    let build = move |_: &Vehicle, set: NamedSettings<'_>| {
        let ports = EstimatorPorts::find(fmu, &map)?;
        let open = ports::unconnected(&fmu.description, &map, &ports::estimator_inputs());
        let stamped = ports
            .stamped
            .map(|stamped| ((stamped, 0), SetTo::Flag(true)));
        let outputs = (ports.numbers.clone(), ports.flags.clone());
        let built = FmuEstimator {
            running: RunningFmu::build(fmu, set, (&open, "wheel_speed[1]"), stamped, outputs)?,
            references: Vec::with_capacity(ports.inputs.len()),
            values: Vec::with_capacity(ports.inputs.len()),
            last: ports.start,
            ports,
        };
        Ok(Box::new(built) as BoxedEstimator)
    };
    Ok(EstimatorType::new(&name, groups, build))
}

/// An FMU in a run.
struct FmuEstimator {
    running: RunningFmu,
    ports: EstimatorPorts,
    /// Inputs of a step: references and values of those that are new.
    references: Vec<Port>,
    values: Vec<f64>,
    last: Estimate,
}

impl Estimator for FmuEstimator {
    fn step(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Estimate, Error> {
        self.references.clear();
        self.values.clear();
        for (reference, source) in &self.ports.inputs {
            if let Some(x) = source.value(z, u) {
                self.references.push(*reference);
                self.values.push(x);
            }
        }
        let (references, values) = (&self.references, &self.values);
        self.running
            .step(|fmu| fmu.set_numbers(references, values), z.t.s(), dt)?;
        let flag = |place: usize| self.running.flags.get(place).copied().unwrap_or_default();
        if self.ports.refused.is_some_and(flag) {
            return Err(Error::own(self.running.told()));
        }
        let e = &mut self.last;
        let numbers = self.ports.numbers_at.iter().zip(&self.running.numbers);
        numbers.for_each(|(put, x)| put(e, *x));
        let flags = self.ports.flags_at.iter().zip(&self.running.flags);
        flags.for_each(|(put, x)| put(e, *x));
        if self.ports.grade_is_effective {
            e.effective_grade_rad = e.grade_rad;
        }
        e.t = z.t;
        checked(*e)
    }

    fn reset(&mut self) {
        self.last = self.ports.start;
        self.running.reset();
    }

    fn snapshot(&self, bytes: &mut [u8]) -> Result<usize, SnapshotError> {
        let state = self.running.save().ok_or(SnapshotError::NotKept)?;
        let room = bytes.get_mut(..state.len());
        room.ok_or(SnapshotError::Room(state.len()))?
            .copy_from_slice(&state);
        Ok(state.len())
    }

    fn restore(&mut self, snapshot: &[u8]) -> Result<(), SnapshotError> {
        match self.running.restore(snapshot) {
            true => Ok(()),
            false => Err(SnapshotError::Corrupt),
        }
    }
}
