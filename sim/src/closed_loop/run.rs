//! THE loop: command → plant → truth → sensors → estimators → controller → observers.

use crate::closed_loop::builder::{Rig, StopAt};
use crate::closed_loop::estimators::Member;
use crate::closed_loop::events::Timeline;
use crate::config::scenario::FeedForward;
use crate::control::{Cycle, Perception, Reference, SpeedController};
use crate::error::Error;
use crate::plant::{Plant, Truth};
use crate::sensors::{Sensors, Suite};
use monorig_estimators::signals::{Command, MAX_DRIVES, Measurements, Value};

/// What observers see after every step of the plant.
pub struct Frame<'a> {
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
    pub bank: &'a [Member],
    /// Things that happened in this step.
    pub events: &'a [String],
}

/// Someone who watches a run.
pub trait Observer {
    /// Whether the costly parts of the truth (clearance) should be up to date at this instant.
    fn wants_truth(&self, _time_ns: i64) -> bool {
        false
    }
    /// A step was made.
    fn see(&mut self, frame: &Frame<'_>) -> Result<(), Error>;
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

/// Run a rig to the end of its scenario. `go_on` is told the share done, 0…1, now and then; when it answers no, the run stops
/// there and the observers still finish.
pub fn run(
    rig: &mut Rig,
    observers: &mut [&mut dyn Observer],
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<Outcome, Error> {
    let end = rig.stop;
    let result = drive(rig, observers, go_on, end);
    for o in observers.iter_mut() {
        let finished = o.finish();
        if result.is_ok() {
            finished?; // else the first error is told: what follows from it would only hide it
        }
    }
    result
}

fn drive(
    rig: &mut Rig,
    observers: &mut [&mut dyn Observer],
    go_on: &mut dyn FnMut(f64) -> bool,
    end: StopAt,
) -> Result<Outcome, Error> {
    let Rig {
        plant,
        sensors,
        bank,
        controller,
        cycle,
        timeline,
        in_loop,
        feedforward,
        ..
    } = rig;
    let plant: &mut dyn Plant = plant.as_mut();
    let mut loop_state = Loop::new(
        rig.nominal_mass_kg,
        rig.dt_s,
        rig.imu_offset_m,
        *in_loop,
        *feedforward,
    );
    let start_front = loop_state.front(plant.truth());
    let (mut finished, mut interrupted) = (false, false);
    loop {
        let truth = plant.truth();
        let (t, front) = (truth.t_s, loop_state.front(truth));
        let arrived = front >= end.at_m;
        if t >= end.after_s - 0.5 * rig.dt_s || arrived {
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
        if front > rig.track_length_m {
            return Err(Error::Broken {
                t_s: t,
                what: format!(
                    "the train ran off the end of the track at {:.1} m",
                    rig.track_length_m
                ),
            });
        }
        loop_state.step(plant, sensors, bank, controller, cycle, timeline)?;
        let time_ns = loop_state.time_ns;
        if observers.iter().any(|o| o.wants_truth(time_ns)) {
            plant.look_around();
        }
        let frame = Frame {
            time_ns,
            truth: plant.truth(),
            measurements: &loop_state.z,
            sampled: loop_state.sampled,
            command: &loop_state.command,
            reference: &loop_state.reference,
            perception: &loop_state.perception,
            bank,
            events: timeline.happened(),
        };
        for o in observers.iter_mut() {
            o.see(&frame)?;
        }
    }
    Ok(Outcome {
        simulated_s: plant.truth().t_s,
        steps: loop_state.steps,
        finished,
        interrupted,
        refusals: bank.iter().filter_map(Member::refusals).collect(),
    })
}

/// What the loop carries from step to step.
struct Loop {
    dt_s: f64,
    imu_offset_m: f64,
    nominal_mass_kg: f64,
    in_loop: Option<usize>,
    feedforward: FeedForward,
    steps: u64,
    time_ns: i64,
    last_sample_s: f64,
    z: Measurements,
    sampled: bool,
    wheel_speed: [Option<f64>; MAX_DRIVES],
    command: Command,
    reference: Reference,
    perception: Perception,
}

impl Loop {
    fn new(
        nominal_mass_kg: f64,
        dt_s: f64,
        imu_offset_m: f64,
        in_loop: Option<usize>,
        feedforward: FeedForward,
    ) -> Self {
        Self {
            dt_s,
            imu_offset_m,
            nominal_mass_kg,
            in_loop,
            feedforward,
            steps: 0,
            time_ns: 0,
            last_sample_s: 0.0,
            z: Measurements::default(),
            sampled: false,
            wheel_speed: [None; MAX_DRIVES],
            command: Command::default(),
            reference: Reference::default(),
            perception: Perception {
                total_mass_kg: nominal_mass_kg,
                ..Default::default()
            },
        }
    }

    /// Chainage of the train's front, m: a positioning system on the track is assumed for the drive cycle.
    fn front(&self, truth: &Truth) -> f64 {
        truth.chainage_m - self.imu_offset_m
    }

    fn step(
        &mut self,
        plant: &mut dyn Plant,
        sensors: &mut Suite,
        bank: &mut [Member],
        controller: &mut SpeedController,
        cycle: &mut Cycle,
        timeline: &mut Timeline,
    ) -> Result<(), Error> {
        let truth = plant.truth();
        let (t, front) = (truth.t_s, self.front(truth));
        self.reference = cycle.at(t, front, self.dt_s);
        self.perception = self.perceive(truth, bank);
        timeline.apply(t, plant, controller);
        self.command = controller.control(
            &self.reference,
            &self.perception,
            timeline.emergency_brake(),
            self.dt_s,
        );
        plant.step(&self.command, self.dt_s)?;
        self.steps += 1;

        let truth = plant.truth();
        self.time_ns = libm::round(truth.t_s * 1e9) as i64;
        self.z = Measurements {
            t_s: truth.t_s,
            ..Measurements::default()
        };
        sensors.measure(truth, &mut self.z)?;
        self.sampled = any_new(&self.z);
        if self.sampled {
            for (old, new) in self.wheel_speed.iter_mut().zip(&self.z.wheel_speed_mps) {
                if let Some(s) = new {
                    *old = Some(s.value);
                }
            }
            let dt = truth.t_s - self.last_sample_s;
            self.last_sample_s = truth.t_s;
            for m in bank.iter_mut() {
                m.step(&self.z, &self.command, dt);
            }
        }
        Ok(())
    }

    /// What the controller is told: speed and slip from the wheels, mass and grade as the feed-forward wants them.
    fn perceive(&self, truth: &Truth, bank: &[Member]) -> Perception {
        let speed_mps = train_speed(&self.wheel_speed);
        let mut slip_mps = [0.0; MAX_DRIVES];
        for (slip, wheel) in slip_mps.iter_mut().zip(&self.wheel_speed) {
            *slip = wheel.map_or(0.0, |v| v - speed_mps);
        }
        let last = &self.perception;
        let in_loop = self.in_loop.and_then(|i| bank.get(i)).map(|m| &m.estimate);
        let (grade_rad, total_mass_kg, vouched) = match (self.feedforward, in_loop) {
            (FeedForward::Truth, _) => (truth.grade_effective_rad, truth.total_mass_kg, true),
            (FeedForward::Estimate, Some(e)) => {
                let vouched = e.effective_grade_rad.valid && e.total_mass_kg.valid;
                // Taken as it is when the estimator begins to vouch, through the lag while it does; held when it does not.
                let share = match (vouched, last.vouched) {
                    (true, true) => self.dt_s / FEEDFORWARD_LAG_S,
                    (true, false) => 1.0,
                    (false, _) => 0.0,
                };
                let follow = |last: f64, v: &Value| last + share * (v.value - last);
                (
                    follow(last.grade_rad, &e.effective_grade_rad),
                    follow(last.total_mass_kg, &e.total_mass_kg),
                    vouched,
                )
            }
            _ => (0.0, self.nominal_mass_kg, false),
        };
        Perception {
            speed_mps,
            grade_rad,
            total_mass_kg,
            vouched,
            slip_mps,
        }
    }
}

/// Speed of the train from the wheels of its drive units, m/s: their median, so that a slipping unit does not mislead; of an
/// even number the slower of the middle two, since wheels that slip under power run ahead.
fn train_speed(wheels: &[Option<f64>; MAX_DRIVES]) -> f64 {
    let mut known = [0.0; MAX_DRIVES];
    let mut n = 0;
    for v in wheels.iter().flatten() {
        known[n] = *v;
        n += 1;
    }
    let known = &mut known[..n];
    known.sort_unstable_by(|a, b| a.abs().total_cmp(&b.abs()));
    n.checked_sub(1).map_or(0.0, |last| known[last / 2])
}

/// An estimate reaches the feed-forward through a lag of this, s. The estimate answers to the torque that it causes; without
/// the lag the two chase each other.
const FEEDFORWARD_LAG_S: f64 = 1.0;

fn any_new(z: &Measurements) -> bool {
    z.specific_force_mps2.is_some()
        || z.angular_rate_radps.is_some()
        || z.motor_torque_nm.iter().any(Option::is_some)
        || z.wheel_speed_mps.iter().any(Option::is_some)
        || z.clamp_pressure_mpa.iter().any(Option::is_some)
        || z.steering_angle_rad.is_some()
}
