//! Perception: speed, slip, mass and grade as the controller sees them.

use crate::config::scenario::FeedForward;
use crate::plant::Truth;
use monorig_estimators::api::signals::{Estimate, MAX_DRIVES, Value};

/// Input of the controller: speed, slip, mass and grade of the train as it perceives them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
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
}

impl Perception {
    /// The perception one step of `dt_s` (s) later: speed and slip from the last `wheel_speed` of each drive unit (m/s), mass
    /// and grade as the feed-forward wants them, from the truth, the estimate in the loop or the nominal mass (kg).
    pub fn next(
        &self,
        wheel_speed: &[Option<f64>; MAX_DRIVES],
        truth: &Truth,
        in_loop: Option<&Estimate>,
        feedforward: FeedForward,
        nominal_mass_kg: f64,
        dt_s: f64,
    ) -> Self {
        let speed_mps = train_speed(wheel_speed);
        let mut slip_mps = [0.0; MAX_DRIVES];
        for (slip, wheel) in slip_mps.iter_mut().zip(wheel_speed) {
            *slip = wheel.map_or(0.0, |v| v - speed_mps);
        }
        let last = self;
        let (grade_rad, total_mass_kg, valid) = match (feedforward, in_loop) {
            (FeedForward::Truth, _) => (truth.grade_effective_rad, truth.total_mass_kg, true),
            (FeedForward::Estimate, Some(e)) => {
                let valid = e.effective_grade_rad.valid && e.total_mass_kg.valid;
                // Taken as it is when the estimate becomes valid, through the lag while it is; held when it is not.
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
            _ => (0.0, nominal_mass_kg, false),
        };
        Perception {
            speed_mps,
            grade_rad,
            total_mass_kg,
            valid,
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
