//! Estimators side by side on the same measurements.

use crate::closed_loop::answers::{AnswerCounter, AnswerCounts};
use crate::closed_loop::registry::BoxedEstimator;
use crate::error::Error;
use crate::guarded::guarded;
use monorig_estimators::Error as Refused;
use monorig_estimators::api::aid::AidStatus;
use monorig_estimators::api::estimator::Internal;
use monorig_estimators::api::signals::{Command, Estimate, Measurements, Value};

/// The values of an estimate that are marked valid or not.
fn values(e: &mut Estimate) -> [&mut Value; 4] {
    [
        &mut e.total_mass_kg,
        &mut e.grade_rad,
        &mut e.effective_grade_rad,
        &mut e.speed_mps,
    ]
}

/// An estimator in a run, with its last estimate and the steps that it refused.
pub struct RunningEstimator {
    /// Name in the scenario.
    pub name: String,
    /// The last estimate.
    pub estimate: Estimate,
    /// Marks a published method without supervision. It is shown beside the others and is not for use.
    pub reference: bool,
    /// Counts of its answers, if the estimator runs outside the program in real time.
    pub(super) answers: Option<AnswerCounter>,
    estimator: BoxedEstimator,
    refused: u64,
    reason: String,
}

impl RunningEstimator {
    /// An estimator under its name.
    pub fn new(name: impl Into<String>, estimator: BoxedEstimator) -> Self {
        Self {
            name: name.into(),
            estimator,
            estimate: Estimate::default(),
            reference: false,
            answers: None,
            refused: 0,
            reason: String::new(),
        }
    }

    /// Wraps the estimator in another estimator, such as one that resets it.
    pub(crate) fn within(mut self, around: &dyn Fn(BoxedEstimator) -> BoxedEstimator) -> Self {
        self.estimator = around(self.estimator);
        self
    }

    /// Gives the estimator new samples. A refused step keeps the last estimate, marked invalid; so is one refused that
    /// marks a value valid that is no finite number. An estimator that cannot go on, or panics, is an error.
    pub fn step(&mut self, z: &Measurements, command: &Command, dt_s: f64) -> Result<(), Error> {
        let broken = |what: String| Error::Estimator {
            name: self.name.clone(),
            seed: None,
            t_s: z.t.s(),
            what,
        };
        let estimator = &mut self.estimator;
        let stepped = guarded(|| estimator.step(z, command, dt_s));
        let stepped = stepped.map_err(|told| broken(format!("it panicked: {told}")))?;
        let refused = match stepped {
            Ok(e) => {
                self.estimate = e;
                let wrong = values(&mut self.estimate)
                    .into_iter()
                    .any(|v| v.valid && !v.value.is_finite());
                wrong.then(|| "it marked a value valid that is not finite".to_owned())
            }
            Err(Refused::Broken(what)) => return Err(broken(what.to_string())),
            Err(e) => Some(e.to_string()),
        };
        let Some(reason) = refused else {
            return Ok(());
        };
        if self.refused == 0 {
            self.reason = reason;
        }
        self.refused += 1;
        self.go_stale();
        Ok(())
    }

    /// Resets the estimator to its first state, at `t_s` (s); the last estimate loses its marks. A panic is an error.
    pub(crate) fn restart(&mut self, t_s: f64) -> Result<(), Error> {
        self.go_stale();
        let estimator = &mut self.estimator;
        guarded(|| estimator.reset()).map_err(|told| Error::Estimator {
            name: self.name.clone(),
            seed: None,
            t_s,
            what: format!("it panicked when it was reset: {told}"),
        })
    }

    /// Removes the marks of the last estimate: nothing new has come for too long.
    pub(crate) fn go_stale(&mut self) {
        for value in values(&mut self.estimate) {
            value.valid = false;
        }
    }

    /// Number of steps that the estimator refused, with the first reason, if any.
    pub(crate) fn refusals(&self) -> Option<(String, u64, String)> {
        (self.refused > 0).then(|| (self.name.clone(), self.refused, self.reason.clone()))
    }

    /// Returns the counts of answers of an estimator that runs outside the program in real time; the rig counts these
    /// answers, so they are not internals of the estimator.
    pub fn answers(&self) -> Option<AnswerCounts> {
        self.answers.as_ref().map(AnswerCounter::get)
    }

    /// Returns the internals by name and unit.
    pub fn list_internals(&self) -> &[Internal] {
        self.estimator.internals()
    }

    /// Returns the present internals with these names; `None` for a name that the estimator does not have.
    pub fn internals_named<const N: usize>(&self, names: [&str; N]) -> [Option<f64>; N] {
        let list = self.list_internals();
        let places = names.map(|name| list.iter().position(|i| i.name == name));
        if places.iter().all(Option::is_none) {
            return [None; N];
        }
        let mut values = vec![f64::NAN; list.len()];
        self.estimator.internal_values(&mut values);
        places.map(|place| values.get(place?).copied())
    }

    /// Appends the present internals to `row` in the order of their names.
    pub fn internals(&self, row: &mut Vec<f64>) {
        let from = row.len();
        row.resize(from + self.list_internals().len(), f64::NAN);
        self.estimator.internal_values(&mut row[from..]);
    }

    /// Sources of measurements that the estimator uses.
    pub(crate) fn aid_sources(&self) -> &[&'static str] {
        self.estimator.aid_sources()
    }

    /// Status of the last measurement of each source, in that order.
    pub(crate) fn aid_status(&self) -> Vec<AidStatus> {
        let mut status = vec![AidStatus::default(); self.aid_sources().len()];
        self.estimator.aid_status(&mut status);
        status
    }
}
