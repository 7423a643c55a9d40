//! The front of an estimator: what makes of the samples of a step the input of the rest, whatever the parameters of the
//! rest are.
//!
//! A search for parameters runs it once over a recording, and a trial runs the rest alone on what it has made, with the
//! same bits.

use crate::api::signals::{Command, Estimate, Measurements};
use crate::preprocess::front_end::{FrontEnd, Reading};
use crate::runner::Pipeline;
use crate::{Error, Real, Time};

/// First stage of a pipeline: turns readings into inputs of the rest. Two that are equal make the same of the same
/// readings.
pub trait Stage: Copy + PartialEq {
    /// Input of the rest in one step.
    type Input: Copy;

    /// The input of one step at the instant `t` after `dt` seconds.
    fn step(&mut self, reading: &Reading, t: Time, dt: Real) -> Self::Input;
}

/// A pipeline whose first stage takes nothing of what the rest finds.
pub trait Staged: Pipeline {
    /// Its first stage.
    type Stage: Stage;

    /// The first stage, as it is now; `None` where it does take something of what the rest finds.
    fn stage(&self) -> Option<Self::Stage>;

    /// One step of the rest. Internals that the first stage finds stay as they are.
    fn advance_on(&mut self, input: &<Self::Stage as Stage>::Input) -> Estimate;
}

/// The whole front of an estimator: signal front end and first stage. Two that are equal make the same of the same
/// samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Front<S> {
    pub(crate) front_end: FrontEnd,
    pub(crate) stage: S,
}

impl<S: Stage> Front<S> {
    /// Checks one step's input and makes of it that of the rest; on an error nothing is changed.
    pub fn step(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<S::Input, Error> {
        let reading = self.front_end.read(z, u, dt)?;
        Ok(self.stage.step(reading, z.t, dt))
    }
}
