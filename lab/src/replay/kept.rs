//! Inputs of what is behind an estimator's front, kept of a recording: what the tuned parameters leave as it is, is
//! computed once.

use crate::metrics::series::ErrorSample;
use crate::replay::ReplayData;
use crate::replay::play::errors;
use monorig_estimators::api::estimator::{Estimator, Internal};
use monorig_estimators::api::signals::{Command, Estimate, Measurements};
use monorig_estimators::registry::{AnyEstimator, AnyFront, AnyInput};
use monorig_estimators::{Error as Refused, Time};
use monorig_sim::error::Error;
use std::sync::{Arc, Mutex, PoisonError};

/// Inputs that a front has made of every step of a recording.
pub struct KeptInputs {
    front: AnyFront,
    /// The input, or why the step was refused.
    steps: Vec<Result<AnyInput, Refused>>,
}

impl KeptInputs {
    /// Runs a front over a recording.
    pub fn new(columns: &ReplayData, front: AnyFront) -> Self {
        let mut running = front;
        let mut inputs = Vec::with_capacity(columns.len());
        let mut steps = columns.steps();
        let mut last_s = 0.0;
        while let Some((z, command, truth)) = steps.advance() {
            inputs.push(running.step(z, command, truth.t_s - last_s));
            last_s = truth.t_s;
        }
        Self {
            front,
            steps: inputs,
        }
    }
}

/// Plays kept inputs to an estimator, and hands its errors on as [`play`](crate::replay::play::play) does, bit for bit.
/// An error where the estimator has another front, panics or diverges (it would start anew, and its front too): then it
/// must be played from the samples.
pub fn play_kept(
    columns: &ReplayData,
    kept: &Arc<KeptInputs>,
    name: &str,
    estimator: AnyEstimator,
    take: impl FnMut(&[ErrorSample]),
) -> Result<(), Error> {
    if estimator.front() != Some(kept.front) {
        return Err(Error::Estimator {
            name: name.into(),
            seed: None,
            t_s: 0.0,
            what: "the inputs kept are those of another front".into(),
        });
    }
    let estimator = OnKept {
        estimator,
        kept: kept.clone(),
        next: 0,
    };
    let (mut steps, mut z) = (columns.truth.iter(), Measurements::default());
    let command = Command::default();
    errors(name, Box::new(estimator), take, |step| {
        let Some(truth) = steps.next() else {
            return Ok(false);
        };
        z.t = Time::from_s(truth.t_s);
        step(&z, &command, truth).map(|()| true)
    })
}

/// An estimator that takes kept inputs in place of samples.
struct OnKept {
    estimator: AnyEstimator,
    kept: Arc<KeptInputs>,
    next: usize,
}

impl Estimator for OnKept {
    fn step(&mut self, _: &Measurements, _: &Command, _: f64) -> Result<Estimate, Refused> {
        let over = || Refused::broken("the recording is over");
        let input = self.kept.steps.get(self.next).ok_or_else(over)?;
        self.next += 1;
        match input {
            Ok(input) => self.estimator.step_on(input).map_err(Refused::broken),
            Err(refused) => Err(*refused),
        }
    }

    fn reset(&mut self) {
        self.estimator.reset();
        self.next = 0;
    }

    fn internals(&self) -> &[Internal] {
        self.estimator.internals()
    }

    fn internal_values(&self, values: &mut [f64]) {
        self.estimator.internal_values(values);
    }
}

/// The kept inputs of one recording: those of the front that was wanted twice in a row. Where each trial has another
/// front, nothing is kept.
#[derive(Default)]
pub(crate) struct KeptOfRun(Mutex<(Option<AnyFront>, Option<Arc<KeptInputs>>)>);

impl KeptOfRun {
    /// The inputs by this front, if they are kept or worth keeping.
    pub(crate) fn get(&self, columns: &ReplayData, front: AnyFront) -> Option<Arc<KeptInputs>> {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let (last, kept) = &mut *known;
        if let Some(kept) = kept.as_ref().filter(|kept| kept.front == front) {
            return Some(kept.clone());
        }
        if last.replace(front) == Some(front) {
            *kept = Some(Arc::new(KeptInputs::new(columns, front)));
            return kept.clone();
        }
        None
    }
}
