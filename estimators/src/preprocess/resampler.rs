//! Resampler for the regressions on the force balance: one matched low-pass for all signals, sampled slowly while the
//! train runs.

use crate::Real;
use crate::api::reading::Reading;
use crate::api::snapshot::state;
use crate::filters::low_pass::MatchedFilter;
use crate::models::force_balance::ForceBalance;
use crate::models::sample::ResampledSample;

/// Speed below which a yaw rate gives no curvature, m/s, and the largest curvature of a rail, 1/m.
const SLOW_MPS: Real = 0.1;
const TIGHTEST_PER_M: Real = 0.5;

/// Resampler: matched low-pass filters for all signals of a regression, sampled at its rate while the train runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resampler {
    force: MatchedFilter,
    speed: MatchedFilter,
    specific_force: MatchedFilter,
    curvature: MatchedFilter,
    rate_hz: Real,
    settle_s: Real,
    running_s: Real,
    since_s: Real,
    /// True if wheel speed was fresh in the last step: without it the place is not known.
    fresh: bool,
}

impl Resampler {
    /// Makes filters with corners at `cutoff_hz`, with a sample every 1/`rate_hz` seconds, beginning `settle_s` after
    /// the train started.
    pub fn new(cutoff_hz: Real, rate_hz: Real, settle_s: Real) -> Self {
        let filter = MatchedFilter::new(cutoff_hz);
        Self {
            force: filter,
            speed: filter,
            specific_force: filter,
            curvature: filter,
            rate_hz,
            settle_s,
            running_s: 0.0,
            since_s: 0.0,
            fresh: false,
        }
    }

    /// Makes one step; returns a sample when one is due. `running`: moving, brake released. Standing, braking or
    /// without wheel speed, the filters' memory must fade before samples count again.
    pub fn step(
        &mut self,
        reading: &Reading,
        balance: &ForceBalance,
        running: bool,
        dt: Real,
    ) -> Option<ResampledSample> {
        let drive = reading.motor_torque_nm.zip(reading.speed_mps);
        let force_n = drive.map(|(torque, speed)| balance.net_traction(torque, speed));
        self.step_force(reading, force_n, running, dt)
    }

    /// Makes one step with a traction minus air drag, N, from the caller.
    pub fn step_force(
        &mut self,
        reading: &Reading,
        force_n: Option<Real>,
        running: bool,
        dt: Real,
    ) -> Option<ResampledSample> {
        let was_fresh = self.fresh;
        self.fresh = reading.speed_mps.is_some();
        let Some(speed) = reading.speed_mps else {
            self.running_s = 0.0;
            return None;
        };
        if !was_fresh {
            // What the speed has become meanwhile must not pass for an acceleration.
            self.speed.empty();
        }
        self.speed.step(speed, dt);
        if let Some(force) = force_n {
            self.force.step(force, dt);
        } else {
            self.force.empty();
        }
        if let Some(f) = reading.specific_force_mps2 {
            self.specific_force.step(f, dt);
        } else {
            self.specific_force.empty();
        }
        self.curvature.step(curvature_per_m(reading), dt);
        let running = running && force_n.is_some();
        self.running_s = if running { self.running_s + dt } else { 0.0 };
        self.since_s += dt;
        if !self.settled() || self.since_s * self.rate_hz < 1.0 - 1e-9 {
            return None;
        }
        let period_s = self.since_s;
        self.since_s = 0.0;
        Some(ResampledSample {
            force_n: self.force.value()?,
            speed_mps: self.speed.value()?,
            acceleration_mps2: self.speed.rate(),
            specific_force_mps2: self.specific_force.value(),
            curvature_per_m: self.curvature.value()?,
            period_s,
        })
    }

    /// Filtered speed, m/s; 0 before the first sample.
    pub fn speed_mps(&self) -> Real {
        self.speed.value().unwrap_or(0.0)
    }

    /// Filtered acceleration of the wheels v̇, m/s².
    pub fn acceleration_mps2(&self) -> Real {
        self.speed.rate()
    }

    /// Returns true if the train has been running long enough for samples to count.
    pub fn settled(&self) -> bool {
        self.running_s > 0.0 && self.running_s >= self.settle_s
    }
}

/// Horizontal curvature of the rail under the train without its sign, |yaw rate|/|v|, 1/m: 0 while standing or without
/// a gyro, and never more than that of the tightest rail.
pub fn curvature_per_m(reading: &Reading) -> Real {
    match reading.yaw_rate_radps.zip(reading.speed_mps) {
        Some((yaw_rate, v)) if v.abs() > SLOW_MPS => (yaw_rate / v).abs().min(TIGHTEST_PER_M),
        _ => 0.0,
    }
}

state!(Resampler { force, speed, specific_force, curvature, running_s, since_s, fresh; rate_hz, settle_s });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::vehicles::vehicle;

    #[test]
    fn samples_come_at_their_rate_and_only_after_settling() {
        let balance = ForceBalance::new(&vehicle());
        let mut resampler = Resampler::new(1.0, 2.0, 1.0);
        let reading = Reading {
            speed_mps: Some(1.0),
            motor_torque_nm: Some(100.0),
            specific_force_mps2: Some(0.5),
            ..Default::default()
        };
        let mut count = |running: bool, steps: usize| {
            (0..steps)
                .filter(|_| resampler.step(&reading, &balance, running, 0.01).is_some())
                .count()
        };
        assert_eq!(count(false, 1000), 0);
        assert_eq!(count(true, 99), 0);
        assert_eq!(count(true, 1001), 21);
        assert_eq!(count(false, 1), 0);
        assert_eq!(count(true, 99), 0);
    }

    #[test]
    fn without_an_accelerometer_there_is_no_specific_force() {
        let balance = ForceBalance::new(&vehicle());
        let mut resampler = Resampler::new(1.0, 100.0, 0.0);
        let mut reading = Reading {
            speed_mps: Some(1.0),
            motor_torque_nm: Some(0.0),
            specific_force_mps2: Some(2.0),
            ..Default::default()
        };
        let first = resampler.step(&reading, &balance, true, 0.01).unwrap();
        assert_eq!(first.specific_force_mps2, Some(2.0));
        reading.specific_force_mps2 = None;
        let second = resampler.step(&reading, &balance, true, 0.01).unwrap();
        assert_eq!(second.specific_force_mps2, None);
    }

    fn rolling(speed_mps: Option<Real>) -> Reading {
        Reading {
            speed_mps,
            motor_torque_nm: Some(0.0),
            ..Default::default()
        }
    }

    #[test]
    fn a_ramp_of_speed_is_its_acceleration() {
        let balance = ForceBalance::new(&vehicle());
        let mut resampler = Resampler::new(2.0, 100.0, 0.0);
        assert_eq!(
            (resampler.speed_mps(), resampler.acceleration_mps2()),
            (0.0, 0.0)
        );
        for k in 0..1_000 {
            let v = 1.0 + 0.003 * k as Real;
            let sample = resampler
                .step(&rolling(Some(v)), &balance, true, 0.01)
                .unwrap();
            assert_eq!(sample.speed_mps, resampler.speed_mps());
            assert_eq!(sample.acceleration_mps2, resampler.acceleration_mps2());
        }
        assert!((resampler.acceleration_mps2() - 0.3).abs() < 1e-6);
        // Late by the filter, two poles at 2 Hz: some tenths of a second.
        let late_s = (1.0 + 0.003 * 999.0 - resampler.speed_mps()) / 0.3;
        assert!((0.05..0.3).contains(&late_s), "{late_s}");
    }

    #[test]
    fn what_the_speed_became_while_it_was_not_known_is_no_acceleration() {
        let balance = ForceBalance::new(&vehicle());
        let mut resampler = Resampler::new(2.0, 100.0, 0.0);
        for _ in 0..100 {
            resampler.step(&rolling(Some(1.0)), &balance, true, 0.01);
        }
        assert_eq!(resampler.step(&rolling(None), &balance, true, 0.01), None);
        for _ in 0..100 {
            let sample = resampler.step(&rolling(Some(2.0)), &balance, true, 0.01);
            assert_eq!(sample.unwrap().acceleration_mps2, 0.0);
        }
    }

    #[test]
    fn standing_there_is_no_sample_however_short_the_settling() {
        let balance = ForceBalance::new(&vehicle());
        let mut resampler = Resampler::new(2.0, 100.0, 0.0);
        for _ in 0..10 {
            assert_eq!(
                resampler.step(&rolling(Some(0.0)), &balance, false, 0.01),
                None
            );
            assert!(!resampler.settled());
        }
    }
}
