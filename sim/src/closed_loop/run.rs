//! THE loop: command → plant → truth → sensors → estimators → controller → observers.

use super::end::Ended;
pub use super::end::Outcome;
use super::estimators::RunningEstimator;
use super::events::Computer;
pub use super::observer::{Observer, StepFrame};
use super::simulation::Simulation;
use super::step_plant::step_plant;
use crate::control::{Perception, Reference};
use crate::error::Error;
use crate::guarded::guarded;
use monorig_estimators::api::signals::{Command, Measurements};

/// Run a simulation to the end of its scenario. `go_on` is given the share done, 0…1, now and then; when it returns
/// false, the run stops there and the observers still finish.
pub fn run(
    simulation: &mut Simulation,
    observers: &mut [&mut dyn Observer],
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<Outcome, Error> {
    for observer in observers.iter_mut() {
        observer.begin(simulation)?;
    }
    let result = closed_loop(simulation, observers, go_on);
    for observer in observers.iter_mut() {
        let finished = observer.finish();
        if result.is_ok() {
            finished?; // else the first error is reported: what follows from it would only hide it
        }
    }
    result
}

impl Simulation {
    /// Run to the end. See [`run`], which can also be stopped.
    pub fn run(&mut self, observers: &mut [&mut dyn Observer]) -> Result<Outcome, Error> {
        run(self, observers, &mut |_| true)
    }
}

fn closed_loop(
    s: &mut Simulation,
    observers: &mut [&mut dyn Observer],
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<Outcome, Error> {
    let mut steps = Steps::default();
    loop {
        if let Some(outcome) = steps.ended(s, go_on)? {
            return Ok(outcome);
        }
        let seen = steps.look(s);
        let command = guarded(|| s.control(&seen)).map_err(|told| Error::Broken {
            t_s: s.plant.truth().t_s,
            what: format!("the controller panicked: {told}"),
        })?;
        steps.make(s, command, &seen, observers)?;
    }
}

/// Input of a controller for a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Seen {
    /// Task of the controller.
    pub reference: Reference,
    /// Inputs of the controller.
    pub perception: Perception,
}

/// The loop in single steps: [`run`] makes all of them, a program that commands the train itself makes one at a time:
/// [`Steps::ended`], [`Steps::look`], [`Steps::make`], and again. It begins and finishes its observers itself.
#[derive(Clone, Copy, Debug, Default)]
pub struct Steps {
    /// Command of the last step.
    command: Command,
    made: u64,
    last_sample_s: f64,
    /// Mean time between samples, s.
    gap_s: f64,
}

/// Time without any sample after which an estimate is stale: at least, s, and in mean gaps between samples.
const STALE_S: f64 = 0.5;
const STALE_GAPS: f64 = 4.0;
/// Number of gaps in the mean of the sampling time.
const GAP_MEMORY: f64 = 16.0;

impl Steps {
    /// Outcome, after the end of the run.
    pub fn ended(
        &self,
        s: &Simulation,
        go_on: &mut dyn FnMut(f64) -> bool,
    ) -> Result<Option<Outcome>, Error> {
        let t_s = s.plant.truth().t_s;
        let ended = s.ended(self.made, go_on)?;
        Ok(ended.map(|ended| Outcome::new(ended, t_s, self.made, &s.estimators)))
    }

    /// Input of the controller for the next step; called once a step. The events that are due act.
    pub fn look(&mut self, s: &mut Simulation) -> Seen {
        Seen {
            perception: s.perceive(&self.command),
            reference: s.reference(),
        }
    }

    /// Makes the step under this command, and shows its result to the observers.
    pub fn make(
        &mut self,
        s: &mut Simulation,
        command: Command,
        seen: &Seen,
        observers: &mut [&mut dyn Observer],
    ) -> Result<(), Error> {
        if let Some(why) = s.controller.broken() {
            return Err(Error::Controller {
                seed: s.seed,
                t_s: s.plant.truth().t_s,
                what: why.to_owned(),
            });
        }
        self.command = command;
        let carried_out = s.events.carried_out(&command, s.train.drives.len());
        step_plant(s, &carried_out)?;
        self.made += 1;
        let mut z = Measurements::default();
        s.sensors.measure(s.plant.truth(), &mut z)?;
        let t_s = s.plant.truth().t_s;
        if z.any() {
            s.perception.measure(&z);
        }
        let computer = s.events.computer(t_s);
        if computer == Computer::UpAgain {
            self.last_sample_s = t_s - s.dt_s;
            s.restart_estimators()?;
        }
        let waited_s = t_s - self.last_sample_s;
        let patience_s = STALE_S.max(STALE_GAPS * self.gap_s);
        let estimated = z.any() && computer != Computer::Down;
        if estimated {
            s.estimate(&z, &command, waited_s)?;
            self.last_sample_s = t_s;
            self.gap_s += (waited_s.min(patience_s) - self.gap_s) / GAP_MEMORY;
        } else if waited_s > patience_s {
            s.estimators.iter_mut().for_each(RunningEstimator::go_stale);
        }
        s.show(observers, &z, estimated, &command, seen)
    }
}

impl Simulation {
    /// Command of the controller for a step.
    pub fn control(&mut self, seen: &Seen) -> Command {
        self.controller
            .control(&seen.reference, &seen.perception, self.dt_s)
    }

    /// Reason for the end before step `steps`; none while the run goes on. A recorded drive ends where its plant is
    /// over.
    fn ended(
        &self,
        steps: u64,
        go_on: &mut dyn FnMut(f64) -> bool,
    ) -> Result<Option<Ended>, Error> {
        let now = (self.plant.truth().t_s, self.dt_s);
        let ended = self.end.reached(now, self.front_m(), steps, go_on)?;
        Ok(ended.or(self.plant.is_over().then_some(Ended::Finished)))
    }

    /// Input of the controller before a step, given the command of the last step.
    fn perceive(&mut self, last: &Command) -> Perception {
        let estimator = self.in_loop.and_then(|i| self.estimators.get(i));
        let estimate = estimator.map(|e| &e.estimate);
        let truth = self.plant.truth();
        *self.perception.next(truth, estimate, last, self.dt_s)
    }

    /// The reference of this step. The events that are due act on it and on the plant.
    fn reference(&mut self) -> Reference {
        let t_s = self.plant.truth().t_s;
        let mut reference = self.cycle.at(t_s, self.front_m(), self.dt_s);
        self.events.apply(t_s, self.plant.as_mut(), &mut reference);
        reference
    }

    /// Gives the samples to every estimator, `dt_s` (s) after the samples before.
    fn estimate(&mut self, z: &Measurements, command: &Command, dt_s: f64) -> Result<(), Error> {
        let mut all = self.estimators.iter_mut();
        let stepped = all.try_for_each(|estimator| estimator.step(z, command, dt_s));
        stepped.map_err(|e| self.of_seed(e))
    }

    /// Resets every estimator.
    fn restart_estimators(&mut self) -> Result<(), Error> {
        let t_s = self.plant.truth().t_s;
        let mut all = self.estimators.iter_mut();
        let restarted = all.try_for_each(|estimator| estimator.restart(t_s));
        restarted.map_err(|e| self.of_seed(e))
    }

    /// The error of an estimator, with the seed of this run.
    fn of_seed(&self, e: Error) -> Error {
        match e {
            Error::Estimator {
                name, t_s, what, ..
            } => Error::Estimator {
                name,
                seed: Some(self.seed),
                t_s,
                what,
            },
            other => other,
        }
    }

    /// Hands the state after the step to the observers. The clearance is costly: it is computed for those that ask for
    /// it.
    fn show(
        &mut self,
        observers: &mut [&mut dyn Observer],
        z: &Measurements,
        estimated: bool,
        command: &Command,
        seen: &Seen,
    ) -> Result<(), Error> {
        let time_ns = z.t.ns();
        if observers.iter().any(|o| o.wants_truth(time_ns)) {
            self.plant.update_clearance();
        }
        let frame = StepFrame {
            time_ns,
            truth: self.plant.truth(),
            measurements: z,
            sampled: z.any(),
            estimated,
            command,
            reference: &seen.reference,
            perception: &seen.perception,
            estimators: &self.estimators,
            events: self.events.happened(),
        };
        observers.iter_mut().try_for_each(|o| o.on_step(&frame))
    }
}
