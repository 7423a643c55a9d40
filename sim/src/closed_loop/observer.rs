//! Observers of a run: recorder, metrics, or one's own.

use super::estimators::RunningEstimator;
use super::simulation::Simulation;
use crate::control::{Perception, Reference};
use crate::error::Error;
use crate::plant::Truth;
use monorig_estimators::api::signals::{Command, Measurements};

/// State of the loop after a step of the plant, handed to the observers.
#[non_exhaustive]
pub struct StepFrame<'a> {
    /// Time since the start, ns.
    pub time_ns: i64,
    /// The truth after the step.
    pub truth: &'a Truth,
    /// Samples that arrived in this step.
    pub measurements: &'a Measurements,
    /// True if a sample arrived.
    pub sampled: bool,
    /// True if the estimators made a step: a sample arrived, and their computer does not restart.
    pub estimated: bool,
    /// Command during the step.
    pub command: &'a Command,
    /// Reference of the controller.
    pub reference: &'a Reference,
    /// Input of the controller.
    pub perception: &'a Perception,
    /// The estimators and their last estimates.
    pub estimators: &'a [RunningEstimator],
    /// Events of this step.
    pub events: &'a [String],
}

/// Observer of a run: called after every step.
pub trait Observer {
    /// The run is about to start.
    fn begin(&mut self, _simulation: &Simulation) -> Result<(), Error> {
        Ok(())
    }
    /// Returns true if the observer needs the costly parts of the truth (clearance) at this instant.
    fn wants_truth(&self, _time_ns: i64) -> bool {
        false
    }
    /// Called after every step of the plant.
    fn on_step(&mut self, frame: &StepFrame<'_>) -> Result<(), Error>;
    /// The run has ended, complete or not.
    fn finish(&mut self) -> Result<(), Error> {
        Ok(())
    }
}

/// A closure is an observer too.
impl<F: FnMut(&StepFrame<'_>)> Observer for F {
    fn on_step(&mut self, frame: &StepFrame<'_>) -> Result<(), Error> {
        self(frame);
        Ok(())
    }
}
