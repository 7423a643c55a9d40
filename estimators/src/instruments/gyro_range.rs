//! Gyro range check: compares the gyro's rates with the fastest turn of a vehicle on wheels.

use crate::Real;
use crate::api::real::GRAVITY;
use crate::api::snapshot::state;
use crate::filters::lag_share::LagShare;
use crate::tuning::{GYRO_RANGE, RAIL, TIMES};

/// Gyro range check: the mean rate of pitch and yaw is at most that of the tightest curve at the speed, min(v ρ, g/v),
/// plus a bias.
///
/// Finds a gyro in °/s for rad/s as soon as the vehicle turns by 1 °/s or the gyro has a bias of 0.15 °/s; one that
/// reads less than that moves nothing else either.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GyroRange {
    mean: [Real; 2],
    speed_mps: Real,
    implausible: bool,
    share: LagShare,
}

impl GyroRange {
    /// One step of `dt` seconds with the rates of pitch and yaw, rad/s, and the speed, m/s.
    pub fn observe(&mut self, rates_radps: [Real; 2], speed_mps: Real, dt: Real) {
        let share = self.share.of(dt, TIMES.lost_s);
        for (mean, now) in self.mean.iter_mut().zip(rates_radps) {
            *mean += share * (now - *mean);
        }
        // The rate lags; so must the speed.
        self.speed_mps += share * (speed_mps.abs() - self.speed_mps);
        let v = self.speed_mps.max(0.1);
        let most = (RAIL.max_track_per_m * v).min(GRAVITY / v) + GYRO_RANGE.max_bias_radps;
        self.implausible = self.mean.iter().any(|rate| rate.abs() > most);
    }

    /// Returns true if the gyro seems to be in rad/s.
    pub fn plausible(&self) -> bool {
        !self.implausible
    }
}

state!(GyroRange { mean, speed_mps, implausible; share });

#[cfg(test)]
mod tests {
    use super::*;

    fn plausible(rates: [Real; 2], speed: Real) -> bool {
        let mut range = GyroRange::default();
        for _ in 0..300 {
            range.observe(rates, speed, 0.01);
        }
        range.plausible()
    }

    #[test]
    fn what_rails_and_roads_do_is_plausible_and_degrees_are_not() {
        // Rail: a curve of 4 m at 0.5 m/s; road: a bend at 6 m/s² and 15 m/s; a bias of 4 °/s.
        let real = [
            ([0.02, 0.125], 0.5),
            ([0.05, 0.4], 15.0),
            ([0.07, 0.07], 0.0),
        ];
        for (rates, speed) in real {
            assert!(plausible(rates, speed), "{rates:?}");
            assert!(
                !plausible(rates.map(|w| w * 57.3), speed),
                "{rates:?} in degrees"
            );
        }
    }

    #[test]
    fn a_swinging_load_is_plausible() {
        let mut range = GyroRange::default();
        for k in 0..2000 {
            range.observe([0.4 * (4.0 * 0.01 * k as Real).sin(), 0.0], 0.5, 0.01);
            assert!(range.plausible());
        }
    }

    /// min(v/2, g/v) rad/s and 0.15 for the bias; the mean is within a quarter of a per cent of its end.
    #[test]
    fn the_limit_is_that_of_the_tightest_curve_and_of_what_a_vehicle_bears() {
        for (speed, most) in [
            (1.0, 0.65),
            (4.0, 2.15),
            (-4.0, 2.15),
            (10.0, 0.1 * GRAVITY + 0.15),
        ] {
            for sign in [1.0, -1.0] {
                assert!(plausible([sign * 0.98 * most, 0.0], speed));
                assert!(!plausible([sign * 1.02 * most, 0.0], speed));
                assert!(!plausible([0.0, sign * 1.02 * most], speed));
            }
        }
    }
}
