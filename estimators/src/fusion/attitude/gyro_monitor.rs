//! Gyro monitor: wheels that agree with each other and contradict the filter mean that the pitch, the gyro's integral,
//! is wrong.
//!
//! The test is the mean of the innovations over its variance, which finds a wrong gyro much sooner than the mean of
//! their squares: with the wheels' noise white, the variance of the mean is S dt/(2 τ).

use crate::Real;
use crate::aiding::wheels::Ballot;
use crate::api::snapshot::state;
use crate::tuning;

/// The monitor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GyroMonitor {
    on: bool,
    sd_mps: Real,
    mean: Real,
    test: Real,
    above_s: Real,
    rest_s: Real,
}

impl GyroMonitor {
    /// Builds the gyro monitor for wheels of the standard deviation `sd_mps`.
    pub fn new(on: bool, sd_mps: Real) -> Self {
        Self {
            on,
            sd_mps,
            mean: 0.0,
            test: 0.0,
            above_s: 0.0,
            rest_s: 0.0,
        }
    }

    /// Notes a shock of the accelerometer: the speed has jumped, which is no sign of a wrong pitch.
    pub fn shock(&mut self) {
        (self.mean, self.rest_s) = (0.0, self.rest_s.max(tuning::TIMES.lost_s));
    }

    /// Takes the innovation of the mean of the wheels and its variance; returns the growth of the variance of the
    /// pitch, rad².
    pub fn step(
        &mut self,
        ballot: &Ballot,
        [y, S]: [Real; 2],
        speed_mps: Real,
        dt: Real,
    ) -> Option<Real> {
        let range = tuning::STATISTICS.agree_sd * self.sd_mps
            + tuning::WHEELS.spread * ballot.speed_mps.abs();
        if ballot.rejected == 0 && (ballot.used == 1 || ballot.range_mps < range) {
            self.mean += (dt / (tuning::TIMES.brief_s + dt)) * (y - self.mean);
        } else {
            (self.mean, self.rest_s) = (0.0, tuning::GYRO_MONITOR.slip_rest_s);
        }
        self.rest_s = (self.rest_s - dt).max(0.0);
        self.test = self.mean * self.mean
            / (S * dt / (2.0 * tuning::TIMES.brief_s)).max(Real::MIN_POSITIVE);
        let excess =
            (self.test - tuning::GYRO_MONITOR.threshold).min(tuning::GYRO_MONITOR.max_excess);
        let above =
            speed_mps.abs() > tuning::MOTION.moves_mps && excess > 0.0 && self.rest_s <= 0.0;
        self.above_s = if above { self.above_s + dt } else { 0.0 };
        (self.on && self.above_s > tuning::GYRO_MONITOR.wait_s)
            .then_some(tuning::GYRO_MONITOR.doubt_rad2ps * excess * dt)
    }

    /// Square of the mean innovation over its variance.
    pub fn test(&self) -> Real {
        self.test
    }
}

state!(GyroMonitor { mean, test, above_s, rest_s; on, sd_mps });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    const SD_MPS: Real = 0.01;
    const DT: Real = 0.01;

    /// Two wheels in use that agree.
    const AGREED: Ballot = Ballot {
        used: 2,
        rejected: 0,
        slipping: 0,
        speed_mps: 2.0,
        range_mps: 0.0,
        limit_mps: 1.0,
        contradicts: false,
    };

    /// The variance that `monitor` adds over these seconds of innovations of `y` with the variance 1e-4.
    fn added(
        monitor: &mut GyroMonitor,
        ballot: &Ballot,
        y: Real,
        speed: Real,
        seconds: Real,
    ) -> Real {
        let step = |_| monitor.step(ballot, [y, 1e-4], speed, DT).unwrap_or(0.0);
        (0..(seconds / DT) as usize).map(step).sum()
    }

    /// White innovations of the variance they are told to have make the test a χ² of one degree of freedom: its mean
    /// is 1, at every rate of samples.
    #[test]
    fn the_test_of_white_innovations_is_a_chi_square() {
        for dt in [0.01, 0.002] {
            let (mut random, mut monitor) = (Random::new(5), GyroMonitor::new(true, SD_MPS));
            let (count, mut sum) = (400_000, 0.0);
            for _ in 0..count {
                let added = monitor.step(&AGREED, [0.3 * random.normal(), 0.09], 1.0, dt);
                assert_eq!(added, None);
                sum += monitor.test();
            }
            let mean = sum / count as Real;
            assert!((mean - 1.0).abs() < 0.1, "{dt} s: {mean}");
        }
    }

    /// Innovations of one sign make the pitch uncertain, by the same per second however large they are, once they have
    /// lasted for a quarter of a second; not at standstill, and not if it is off.
    #[test]
    fn a_contradiction_that_lasts_is_doubt_of_the_pitch() {
        let most = tuning::GYRO_MONITOR.doubt_rad2ps * tuning::GYRO_MONITOR.max_excess;
        for y in [0.1, -0.4] {
            let mut monitor = GyroMonitor::new(true, SD_MPS);
            assert_eq!(added(&mut monitor, &AGREED, y, 1.0, 0.24), 0.0);
            let second = added(&mut monitor, &AGREED, y, -1.0, 1.0);
            assert!((second / most - 1.0).abs() < 0.1, "{second}");
            assert_eq!(added(&mut monitor, &AGREED, y, 0.04, 1.0), 0.0);
            let mut off = GyroMonitor::new(false, SD_MPS);
            assert_eq!(added(&mut off, &AGREED, y, 1.0, 2.0), 0.0);
        }
    }

    /// Wheels that differ by more than their noise and creep, or of which one is rejected, may slip: they contradict
    /// nothing until they have agreed for a second and a half again. One wheel alone agrees with itself.
    #[test]
    fn wheels_that_may_slip_contradict_nothing() {
        let creep = tuning::WHEELS.spread * AGREED.speed_mps;
        let range = tuning::STATISTICS.agree_sd * SD_MPS + creep;
        let apart = |by| Ballot {
            range_mps: by * range,
            ..AGREED
        };
        let back = |ballot| Ballot {
            speed_mps: -2.0,
            ..ballot
        };
        let rejected = Ballot {
            rejected: 1,
            ..AGREED
        };
        let alone = Ballot {
            used: 1,
            ..apart(2.0)
        };
        for (ballot, doubts) in [
            (apart(0.99), true),
            (back(apart(0.99)), true),
            (apart(1.01), false),
            (rejected, false),
            (alone, true),
        ] {
            let mut monitor = GyroMonitor::new(true, SD_MPS);
            assert_eq!(added(&mut monitor, &ballot, 0.1, 1.0, 2.0) > 0.0, doubts);
            let soon = added(&mut monitor, &AGREED, 0.1, 1.0, 1.4) > 0.0;
            assert_eq!(soon, doubts, "{ballot:?}");
            assert!(added(&mut monitor, &AGREED, 0.1, 1.0, 1.0) > 0.0);
        }
    }

    /// A shock of the accelerometer has made the speed jump: the monitor forgets, and rests for half a second.
    #[test]
    fn after_a_shock_it_rests() {
        let mut monitor = GyroMonitor::new(true, SD_MPS);
        assert!(added(&mut monitor, &AGREED, 0.1, 1.0, 2.0) > 0.0);
        monitor.shock();
        assert_eq!(added(&mut monitor, &AGREED, 0.1, 1.0, 0.5 + 0.2), 0.0);
        assert!(added(&mut monitor, &AGREED, 0.1, 1.0, 0.3) > 0.0);
    }
}
