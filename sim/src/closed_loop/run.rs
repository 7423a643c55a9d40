//! THE loop: command → plant → truth → sensors → estimators → controller → observers.

use super::end::Ended;
pub use super::end::Outcome;
pub use super::observer::{Observer, StepFrame};
use super::simulation::Simulation;
use crate::control::{Perception, Reference};
use crate::error::Error;
use crate::plant::divergence::Causes;
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
    let (mut command, mut steps, mut last_sample_s) = (Command::default(), 0, 0.0);
    loop {
        if let Some(ended) = s.ended(steps, go_on)? {
            let t_s = s.plant.truth().t_s;
            return Ok(Outcome::new(ended, t_s, steps, &s.estimators));
        }
        let perception = s.perceive(&command);
        let reference = s.reference();
        command = s.controller.control(&reference, &perception, s.dt_s);
        let causes = Causes {
            train: &s.train,
            gravity_mps2: s.scenario.file.physics.gravity_mps2.get(),
            dt_s: s.dt_s,
        };
        causes.step(s.plant.as_mut(), &command)?;
        steps += 1;
        let z = s.measure()?;
        if z.any() {
            let t_s = s.plant.truth().t_s;
            s.estimate(&z, &command, t_s - last_sample_s);
            last_sample_s = t_s;
        }
        s.show(observers, &z, &command, &reference, &perception)?;
    }
}

impl Simulation {
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

    /// The input of the controller before a step, given the command of the last one.
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

    /// The samples that arrive in this step.
    fn measure(&mut self) -> Result<Measurements, Error> {
        let mut z = Measurements::default();
        self.sensors.measure(self.plant.truth(), &mut z)?;
        Ok(z)
    }

    /// Gives the samples to the perception and to every estimator, `dt_s` (s) after the last ones.
    fn estimate(&mut self, z: &Measurements, command: &Command, dt_s: f64) {
        self.perception.measure(z);
        for estimator in &mut self.estimators {
            estimator.step(z, command, dt_s);
        }
    }

    /// Hands the state after the step to the observers. The clearance is costly: it is computed for those that ask for
    /// it.
    fn show(
        &mut self,
        observers: &mut [&mut dyn Observer],
        z: &Measurements,
        command: &Command,
        reference: &Reference,
        perception: &Perception,
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
            command,
            reference,
            perception,
            estimators: &self.estimators,
            events: self.events.happened(),
        };
        observers.iter_mut().try_for_each(|o| o.on_step(&frame))
    }
}
