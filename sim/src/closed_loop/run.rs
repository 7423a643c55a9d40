//! THE loop: command → plant → truth → sensors → estimators → controller → observers.

use super::end::Ended;
pub use super::end::Outcome;
pub use super::observer::{Observer, StepFrame};
use super::simulation::Simulation;
use crate::control::Perception;
use crate::error::Error;
use monorig_estimators::api::signals::{Command, Measurements};

/// Run a simulation to the end of its scenario. `go_on` is given the share done, 0…1, now and then; when it returns false, the run
/// stops there and the observers still finish.
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
        let (t_s, front_m) = (s.plant.truth().t_s, s.front_m());
        if let Some(ended) = s.end.reached((t_s, s.dt_s), front_m, steps, go_on)? {
            return Ok(Outcome::new(ended, t_s, steps, &s.estimators));
        }
        if s.plant.is_over() {
            return Ok(Outcome::new(Ended::Finished, t_s, steps, &s.estimators));
        }
        let mut reference = s.cycle.at(t_s, front_m, s.dt_s);
        let perception = perceive(s, &command);
        s.events.apply(t_s, s.plant.as_mut(), &mut reference);
        command = s.controller.control(&reference, &perception, s.dt_s);
        s.plant.step(&command, s.dt_s)?;
        steps += 1;
        let (mut z, t_s) = (Measurements::default(), s.plant.truth().t_s);
        s.sensors.measure(s.plant.truth(), &mut z)?;
        let sampled = z.any();
        if sampled {
            s.perception.measure(&z);
            for estimator in &mut s.estimators {
                estimator.step(&z, &command, t_s - last_sample_s);
            }
            last_sample_s = t_s;
        }
        if observers.iter().any(|o| o.wants_truth(z.t.ns())) {
            s.plant.update_clearance();
        }
        let frame = StepFrame {
            time_ns: z.t.ns(),
            truth: s.plant.truth(),
            measurements: &z,
            sampled,
            command: &command,
            reference: &reference,
            perception: &perception,
            estimators: &s.estimators,
            events: s.events.happened(),
        };
        observers.iter_mut().try_for_each(|o| o.on_step(&frame))?;
    }
}

/// What the controller sees before a step, given the command of the last one.
fn perceive(s: &mut Simulation, last: &Command) -> Perception {
    let estimator = s.in_loop.and_then(|i| s.estimators.get(i));
    let estimate = estimator.map(|e| &e.estimate);
    *s.perception.next(s.plant.truth(), estimate, last, s.dt_s)
}
