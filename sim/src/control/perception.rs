//! Perception: speed, slip, mass and grade as the controller sees them.

use crate::config::scenario::FeedForward;
use crate::plant::Truth;
use monorig_estimators::api::signals::{Estimate, MAX_DRIVES, Measurements, Value};

/// Input of the controller: speed, slip, mass and grade of the train as measured and estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Perception {
    /// Speed along the rail, m/s.
    pub speed_mps: f64,
    /// Grade for the feed-forward, rad; 0 without one.
    pub grade_rad: f64,
    /// Total mass for the feed-forward, kg; the nominal one without.
    pub total_mass_kg: f64,
    /// Whether grade and mass are known now, and not held or nominal values.
    pub valid: bool,
    /// Wheel speed of each drive unit minus the speed, m/s: what spins or locks.
    pub slip_mps: [f64; MAX_DRIVES],
    /// The last estimate of the estimator in the loop as it is, if there is one.
    pub estimate: Option<Estimate>,
}

/// Makes the perception of each step: holds the last wheel speeds, and the last mass and grade of the feed-forward.
#[derive(Clone, Debug)]
pub struct PerceptionModel {
    feedforward: FeedForward,
    nominal_mass_kg: f64,
    wheel_speed_mps: [Option<f64>; MAX_DRIVES],
    now: Perception,
}

impl PerceptionModel {
    /// A model whose feed-forward takes mass and grade from `feedforward`, and has the nominal mass (kg) without.
    pub fn new(feedforward: FeedForward, nominal_mass_kg: f64) -> Self {
        Self {
            feedforward,
            nominal_mass_kg,
            wheel_speed_mps: [None; MAX_DRIVES],
            now: Perception {
                total_mass_kg: nominal_mass_kg,
                ..Perception::default()
            },
        }
    }

    /// Keep the wheel speeds that arrived in this step.
    pub fn measure(&mut self, z: &Measurements) {
        for (old, new) in self.wheel_speed_mps.iter_mut().zip(&z.wheel_speed_mps) {
            if let Some(sample) = new {
                *old = Some(sample.value);
            }
        }
    }

    /// The perception `dt_s` (s) after the last one: speed and slip from the wheels of each drive unit, mass and grade of the
    /// feed-forward from the truth, the estimate in the loop or the nominal mass.
    pub fn next(&mut self, truth: &Truth, in_loop: Option<&Estimate>, dt_s: f64) -> &Perception {
        let speed_mps = train_speed(&self.wheel_speed_mps);
        let slip = |wheel: Option<f64>| wheel.map_or(0.0, |v| v - speed_mps);
        let (grade_rad, total_mass_kg, valid) = match (self.feedforward, in_loop) {
            (FeedForward::Truth, _) => (truth.grade_effective_rad, truth.total_mass_kg, true),
            (FeedForward::Estimate, Some(e)) => self.follow(e, dt_s),
            _ => (0.0, self.nominal_mass_kg, false),
        };
        self.now = Perception {
            speed_mps,
            grade_rad,
            total_mass_kg,
            valid,
            slip_mps: self.wheel_speed_mps.map(slip),
            estimate: in_loop.copied(),
        };
        &self.now
    }

    /// Grade, mass and validity for the feed-forward: the estimate as it is when it becomes valid, through the lag while it is
    /// valid, held while it is not.
    fn follow(&self, e: &Estimate, dt_s: f64) -> (f64, f64, bool) {
        let last = &self.now;
        let valid = e.effective_grade_rad.valid && e.total_mass_kg.valid;
        let share = match (valid, last.valid) {
            (true, true) => dt_s / FEEDFORWARD_LAG_S,
            (true, false) => 1.0,
            (false, _) => 0.0,
        };
        let follow = |last: f64, v: &Value| last + share * (v.value - last);
        (
            follow(last.grade_rad, &e.effective_grade_rad),
            follow(last.total_mass_kg, &e.total_mass_kg),
            valid,
        )
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
