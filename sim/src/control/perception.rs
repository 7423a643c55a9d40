//! Perception: speed, slip, mass and grade as inputs of the controller.

use crate::plant::Truth;
use monorig_estimators::api::signals::{
    Command, Estimate, MAX_DRIVES, Measurements, Value, Vehicle,
};
use monorig_estimators::preprocess::wheel_speed_vote::WheelSpeedVote;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Input of the controller: speed, slip, mass and grade of the train as measured and estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Perception {
    /// Speed along the rail, m/s.
    pub speed_mps: f64,
    /// Grade for the feed-forward, rad; 0 if none is known.
    pub grade_rad: f64,
    /// Total mass for the feed-forward, kg; the nominal mass if none is known.
    pub total_mass_kg: f64,
    /// True if grade and mass are present values, and not held or nominal values.
    pub valid: bool,
    /// Wheel speed of each drive unit minus the speed, m/s: what spins or locks.
    pub slip_mps: [f64; MAX_DRIVES],
    /// Last estimate of the estimator in the loop, unchanged, if there is an estimator.
    pub estimate: Option<Estimate>,
}

/// Source of slope and mass for the feed-forward.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FeedForward {
    /// None.
    #[default]
    None,
    /// The truth (an upper limit, not a real controller).
    Truth,
    /// The estimator in the loop.
    Estimate,
}

/// Makes the perception of each step: holds the last wheel speeds, and the last mass and grade of the feed-forward.
#[derive(Clone, Debug)]
pub struct PerceptionModel {
    feedforward: FeedForward,
    nominal_mass_kg: f64,
    vote: WheelSpeedVote,
    wheel_speed_mps: [Option<f64>; MAX_DRIVES],
    /// Time since the vote last gave a speed, s.
    unknown_s: f64,
    now: Perception,
}

impl PerceptionModel {
    /// Makes a perception whose mass and grade for the feed-forward come from `feedforward`; without a source the mass
    /// is the nominal mass (kg).
    pub fn new(feedforward: FeedForward, nominal_mass_kg: f64, vehicle: &Vehicle) -> Self {
        Self {
            feedforward,
            nominal_mass_kg,
            vote: WheelSpeedVote::new(vehicle.standstill_mps(None)),
            unknown_s: 0.0,
            wheel_speed_mps: [None; MAX_DRIVES],
            now: Perception {
                total_mass_kg: nominal_mass_kg,
                ..Perception::default()
            },
        }
    }

    /// Stores the wheel speeds that arrived in this step.
    pub fn measure(&mut self, z: &Measurements) {
        for (old, new) in self.wheel_speed_mps.iter_mut().zip(&z.wheel_speed_mps) {
            if let Some(sample) = new {
                *old = Some(sample.value);
            }
        }
    }

    /// The perception `dt_s` (s) after the last one: speed and slip from the wheels of each drive unit, mass and grade
    /// of the feed-forward from the truth, the estimate in the loop or the nominal mass. `command` is that of the last
    /// step.
    pub fn next(
        &mut self,
        truth: &Truth,
        in_loop: Option<&Estimate>,
        command: &Command,
        dt_s: f64,
    ) -> &Perception {
        let speed_mps = self.train_speed_mps(command.motor_torque_nm.iter().sum(), dt_s);
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

    /// Speed of the train by the vote of its wheels, m/s, under a motor torque of this sign. Where the vote gives none
    /// because too many wheels slip, the last speed is held (dead reckoning) for at most [`SPEED_HOLD_S`]; then the
    /// median wheel counts.
    fn train_speed_mps(&mut self, motor_torque_nm: f64, dt_s: f64) -> f64 {
        let wheels = || self.wheel_speed_mps.iter().flatten().copied();
        if let Some(speed_mps) = self.vote.speed_mps(wheels(), motor_torque_nm) {
            self.unknown_s = 0.0;
            return speed_mps;
        }
        self.unknown_s += dt_s;
        let mut sorted: Vec<f64> = wheels().collect();
        sorted.sort_unstable_by(|a, b| a.abs().total_cmp(&b.abs()));
        match sorted.len().checked_sub(1) {
            Some(last) if self.unknown_s > SPEED_HOLD_S => sorted[last / 2],
            _ => self.now.speed_mps,
        }
    }

    /// Grade, mass and validity for the feed-forward: the estimate as it is when it becomes valid, through the lag
    /// while it is valid, held while it is not.
    fn follow(&self, e: &Estimate, dt_s: f64) -> (f64, f64, bool) {
        let last = &self.now;
        let valid = e.effective_grade_rad.valid && e.total_mass_kg.valid;
        let share = match (valid, last.valid) {
            (true, true) => dt_s / FEEDFORWARD_LAG_S,
            (true, false) => 1.0,
            // held: a value that is not valid need not be a number
            (false, _) => return (last.grade_rad, last.total_mass_kg, false),
        };
        let follow = |last: f64, v: &Value| last + share * (v.value - last);
        (
            follow(last.grade_rad, &e.effective_grade_rad),
            follow(last.total_mass_kg, &e.total_mass_kg),
            valid,
        )
    }
}

/// Time for which the last speed is held if the wheels do not show the speed, s.
const SPEED_HOLD_S: f64 = 1.0;

/// Time constant of the lag between an estimate and the feed-forward, s. The estimate answers to the torque that it
/// causes; without the lag the two chase each other.
const FEEDFORWARD_LAG_S: f64 = 1.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::vehicle;
    use monorig_estimators::Time;
    use monorig_estimators::api::signals::Sample;

    const DT_S: f64 = 0.002;

    fn model(feedforward: FeedForward) -> PerceptionModel {
        PerceptionModel::new(feedforward, 15e3, &vehicle())
    }

    /// Speed after `steps` steps with these wheel speeds under driving torque.
    fn speed(model: &mut PerceptionModel, wheels: &[f64], steps: usize) -> f64 {
        let mut z = Measurements::default();
        for (slot, value) in z.wheel_speed_mps.iter_mut().zip(wheels) {
            let t = Time::from_s(0.0);
            *slot = Some(Sample { t, value: *value });
        }
        model.measure(&z);
        let mut driving = Command::default();
        driving.motor_torque_nm[0] = 50.0;
        let truth = Truth::default();
        for _ in 0..steps {
            model.next(&truth, None, &driving, DT_S);
        }
        model.now.speed_mps
    }

    #[test]
    fn wheels_that_slip_do_not_move_the_speed_and_show_as_slip() {
        let mut m = model(FeedForward::None);
        assert_eq!(speed(&mut m, &[1.0; 8], 1), 1.0);
        let half = [1.4, 1.0, 1.4, 1.0, 1.5, 1.0, 1.4, 1.0];
        assert_eq!(speed(&mut m, &half, 1), 1.0);
        assert!((m.now.slip_mps[4] - 0.5).abs() < 1e-12 && m.now.slip_mps[1] == 0.0);
    }

    #[test]
    fn where_nearly_all_slip_the_speed_is_held_for_a_second_and_no_longer() {
        let mut m = model(FeedForward::None);
        assert_eq!(speed(&mut m, &[1.0; 8], 1), 1.0);
        let most = [1.0, 1.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0];
        let held = (SPEED_HOLD_S / DT_S) as usize - 1;
        assert_eq!(speed(&mut m, &most, held), 1.0);
        assert_eq!(speed(&mut m, &most, 3), 2.0);
    }

    /// The step answer of a first-order lag is 1 − exp(−t/T); what is not valid is held.
    #[test]
    fn an_estimate_is_taken_followed_through_the_lag_and_held() {
        let mut m = model(FeedForward::Estimate);
        let estimate = |kg: f64, valid: bool| {
            let mut e = Estimate::default();
            (e.total_mass_kg.value, e.total_mass_kg.valid) = (kg, valid);
            e.effective_grade_rad.valid = valid;
            e
        };
        let mut mass = |e: Estimate, steps: usize| {
            let (truth, still) = (Truth::default(), Command::default());
            for _ in 0..steps {
                m.next(&truth, Some(&e), &still, DT_S);
            }
            m.now.total_mass_kg
        };
        assert_eq!(mass(estimate(99e3, false), 10), 15e3);
        assert_eq!(mass(estimate(20e3, true), 1), 20e3);
        let half_way = mass(estimate(30e3, true), 500);
        let expected = 30e3 - 10e3 * (-1.0f64).exp();
        assert!((half_way / expected - 1.0).abs() < 1e-3, "{half_way}");
        assert_eq!(mass(estimate(99e3, false), 100), half_way);
        assert_eq!(mass(estimate(f64::NAN, false), 100), half_way);
    }
}
