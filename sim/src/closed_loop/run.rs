//! THE loop: command → plant → truth → sensors → estimators → controller → observers.

use crate::closed_loop::builder::{Simulation, StopAt};
use crate::closed_loop::estimators::RunningEstimator;
use crate::closed_loop::events::EventSchedule;
use crate::control::{Controller, Cycle, Perception, PerceptionModel, Reference};
use crate::error::Error;
use crate::plant::{Plant, Truth};
use crate::sensors::Suite;
use monorig_estimators::Time;
use monorig_estimators::api::signals::{Command, Measurements};

/// State of the loop after a step of the plant, handed to the observers.
pub struct StepFrame<'a> {
    /// Time since the start, ns.
    pub time_ns: i64,
    /// The truth after the step.
    pub truth: &'a Truth,
    /// Samples that arrived in this step.
    pub measurements: &'a Measurements,
    /// Whether any sample arrived, so that the estimators made a step.
    pub sampled: bool,
    /// What was commanded during the step.
    pub command: &'a Command,
    /// What the drive cycle asked for.
    pub reference: &'a Reference,
    /// What the controller was told.
    pub perception: &'a Perception,
    /// The estimators and their last estimates.
    pub estimators: &'a [RunningEstimator],
    /// Things that happened in this step.
    pub events: &'a [String],
}

/// Observer of a run: called after every step.
pub trait Observer {
    /// Whether the costly parts of the truth (clearance) should be up to date at this instant.
    fn wants_truth(&self, _time_ns: i64) -> bool {
        false
    }
    /// Called after every step of the plant.
    fn on_step(&mut self, frame: &StepFrame<'_>) -> Result<(), Error>;
    /// The run is over, whole or not.
    fn finish(&mut self) -> Result<(), Error> {
        Ok(())
    }
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Simulated time, s.
    pub simulated_s: f64,
    /// Steps of the plant.
    pub steps: u64,
    /// Whether the scenario's end was reached: its chainage if it names one, else its time.
    pub finished: bool,
    /// Whether it was stopped from outside.
    pub interrupted: bool,
    /// Steps each estimator refused, by name, with the first reason.
    pub refusals: Vec<(String, u64, String)>,
}

/// Run a simulation to the end of its scenario. `go_on` is told the share done, 0…1, now and then; when it answers no, the run stops
/// there and the observers still finish.
pub fn run(
    simulation: &mut Simulation,
    observers: &mut [&mut dyn Observer],
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<Outcome, Error> {
    let end = simulation.stop;
    let result = drive(simulation, observers, go_on, end);
    for o in observers.iter_mut() {
        let finished = o.finish();
        if result.is_ok() {
            finished?; // else the first error is told: what follows from it would only hide it
        }
    }
    result
}

fn drive(
    simulation: &mut Simulation,
    observers: &mut [&mut dyn Observer],
    go_on: &mut dyn FnMut(f64) -> bool,
    end: StopAt,
) -> Result<Outcome, Error> {
    let Simulation {
        plant,
        sensors,
        estimators,
        controller,
        cycle,
        events,
        in_loop,
        perception,
        ..
    } = simulation;
    let plant: &mut dyn Plant = plant.as_mut();
    let mut loop_state = Loop::new(simulation.dt_s, simulation.imu_offset_m, *in_loop);
    let start_front = loop_state.front(plant.truth());
    let (mut finished, mut interrupted) = (false, false);
    loop {
        let truth = plant.truth();
        let (t, front) = (truth.t_s, loop_state.front(truth));
        let arrived = front >= end.at_m;
        if t >= end.after_s - 0.5 * simulation.dt_s || arrived {
            finished = arrived || end.at_m == f64::INFINITY;
            break;
        }
        if loop_state.steps.is_multiple_of(512) {
            let by_time = t / end.after_s;
            let by_way = (front - start_front) / (end.at_m - start_front);
            if !go_on(by_time.max(by_way).clamp(0.0, 1.0)) {
                interrupted = true;
                break;
            }
        }
        if front > simulation.track_length_m {
            return Err(Error::Broken {
                t_s: t,
                what: format!(
                    "the train ran off the end of the track at {:.1} m",
                    simulation.track_length_m
                ),
            });
        }
        loop_state.step(
            plant,
            sensors,
            estimators,
            controller.as_mut(),
            cycle,
            events,
            perception,
        )?;
        let time_ns = loop_state.time_ns;
        if observers.iter().any(|o| o.wants_truth(time_ns)) {
            plant.update_clearance();
        }
        let frame = StepFrame {
            time_ns,
            truth: plant.truth(),
            measurements: &loop_state.z,
            sampled: loop_state.sampled,
            command: &loop_state.command,
            reference: &loop_state.reference,
            perception: &loop_state.perception,
            estimators,
            events: events.happened(),
        };
        for o in observers.iter_mut() {
            o.on_step(&frame)?;
        }
    }
    Ok(Outcome {
        simulated_s: plant.truth().t_s,
        steps: loop_state.steps,
        finished,
        interrupted,
        refusals: estimators
            .iter()
            .filter_map(RunningEstimator::refusals)
            .collect(),
    })
}

/// What the loop carries from step to step.
struct Loop {
    dt_s: f64,
    imu_offset_m: f64,
    in_loop: Option<usize>,
    steps: u64,
    time_ns: i64,
    last_sample_s: f64,
    z: Measurements,
    sampled: bool,
    command: Command,
    reference: Reference,
    perception: Perception,
}

impl Loop {
    fn new(dt_s: f64, imu_offset_m: f64, in_loop: Option<usize>) -> Self {
        Self {
            dt_s,
            imu_offset_m,
            in_loop,
            steps: 0,
            time_ns: 0,
            last_sample_s: 0.0,
            z: Measurements::default(),
            sampled: false,
            command: Command::default(),
            reference: Reference::default(),
            perception: Perception::default(),
        }
    }

    /// Chainage of the train's front, m: a positioning system on the track is assumed for the drive cycle.
    fn front(&self, truth: &Truth) -> f64 {
        truth.chainage_m - self.imu_offset_m
    }

    #[allow(clippy::too_many_arguments)]
    fn step(
        &mut self,
        plant: &mut dyn Plant,
        sensors: &mut Suite,
        estimators: &mut [RunningEstimator],
        controller: &mut dyn Controller,
        cycle: &mut Cycle,
        events: &mut EventSchedule,
        perception: &mut PerceptionModel,
    ) -> Result<(), Error> {
        let truth = plant.truth();
        let (t, front) = (truth.t_s, self.front(truth));
        self.reference = cycle.at(t, front, self.dt_s);
        let in_loop = self.in_loop.and_then(|i| estimators.get(i));
        self.perception = *perception.next(truth, in_loop.map(|m| &m.estimate), self.dt_s);
        events.apply(t, plant, &mut self.reference);
        self.command = controller.control(&self.reference, &self.perception, self.dt_s);
        plant.step(&self.command, self.dt_s)?;
        self.steps += 1;

        let truth = plant.truth();
        self.time_ns = libm::round(truth.t_s * 1e9) as i64;
        self.z = Measurements {
            t: Time::from_ns(self.time_ns),
            ..Measurements::default()
        };
        sensors.measure(truth, &mut self.z)?;
        self.sampled = self.z.any();
        if self.sampled {
            perception.measure(&self.z);
            let dt = truth.t_s - self.last_sample_s;
            self.last_sample_s = truth.t_s;
            for m in estimators.iter_mut() {
                m.step(&self.z, &self.command, dt);
            }
        }
        Ok(())
    }
}
