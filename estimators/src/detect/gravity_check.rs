//! Gravity check: whether an accelerometer reads about one g, upwards.

use crate::Real;
use crate::api::real::{GRAVITY, sqrt};
use crate::api::snapshot::state;
use crate::filters::lag_share::LagShare;
use crate::tuning::{GRAVITY_CHECK, TIMES};

/// Gravity check of a three-axis accelerometer: the mean specific force must be g within a fifth or a quarter, and
/// its largest part must point up the vertical axis.
///
/// Finds an accelerometer in g for m/s², a vertical axis swapped with another, and all axes of the wrong sign. It does
/// not see a swap of the two horizontal axes, nor a wrong sign of the forward one: both leave gravity as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GravityCheck {
    mean: Option<[Real; 3]>,
    seen_s: Real,
    plausible: bool,
    share: LagShare,
}

impl GravityCheck {
    /// One step of `dt` seconds with the specific force in IMU axes, m/s².
    pub fn observe(&mut self, force_mps2: [Real; 3], dt: Real) {
        let Some(mean) = &mut self.mean else {
            self.mean = Some(force_mps2);
            return;
        };
        let share = self.share.of(dt, TIMES.mean_s);
        for (mean, now) in mean.iter_mut().zip(force_mps2) {
            *mean += share * (now - *mean);
        }
        self.seen_s = (self.seen_s + dt).min(TIMES.mean_s);
        let [x, y, z] = *mean;
        let size = sqrt(x * x + y * y + z * z) / GRAVITY;
        let [least, most] = GRAVITY_CHECK.size;
        self.plausible = (least..=most).contains(&size) && z > GRAVITY_CHECK.min_upright * GRAVITY;
    }

    /// Returns true if the accelerometer seems to be upright and in m/s²; also in the first second.
    pub fn plausible(&self) -> bool {
        self.plausible || self.seen_s < TIMES.mean_s
    }
}

state!(GravityCheck { mean, seen_s, plausible; share });

#[cfg(test)]
mod tests {
    use super::*;

    fn plausible(force: [Real; 3]) -> bool {
        let mut check = GravityCheck::default();
        assert!(check.plausible());
        for _ in 0..300 {
            check.observe(force, 0.01);
        }
        check.plausible()
    }

    #[test]
    fn one_g_upwards_is_plausible_and_nothing_else() {
        let (sine, cosine) = 0.5f64.sin_cos();
        let slope = [9.81 * sine as Real, 0.0, 9.81 * cosine as Real];
        assert!(plausible(slope));
        let [x, y, z] = slope;
        assert!(!plausible(slope.map(|f| f / 9.81))); // in g
        assert!(!plausible([z, y, x])); // forward and up swapped
        assert!(!plausible([x, z, y])); // left and up swapped
        assert!(!plausible(slope.map(|f| -f)));
        assert!(plausible([x + 3.0, y, z])); // a start at 3 m/s²
        assert!(plausible([0.3, 0.2, 9.7])); // an uncalibrated one
    }

    /// Size of the mean 0.8 to 1.25 g, half of it upright.
    #[test]
    fn the_limits_are_a_fifth_and_a_quarter() {
        for (share, fine) in [(0.79, false), (0.81, true), (1.24, true), (1.26, false)] {
            let force = [2.0, 3.0, 6.0].map(|part| share * GRAVITY * part / 7.0);
            assert_eq!(plausible(force), fine, "{share}");
        }
        for (upright, fine) in [(0.51, true), (0.49, false)] {
            let across = GRAVITY * (1.0 - upright * upright as Real).sqrt();
            assert_eq!(plausible([across, 0.0, GRAVITY * upright]), fine);
            assert_eq!(plausible([0.0, -across, GRAVITY * upright]), fine);
        }
    }

    #[test]
    fn a_mean_of_a_second_counts() {
        let mut check = GravityCheck::default();
        let mut run = |up: Real, steps: usize| {
            (0..steps).for_each(|_| check.observe([0.0, 0.0, up], 0.01));
            check.plausible()
        };
        assert!(!run(0.0, 200));
        // 0.8 g after 1.6 time constants
        assert!(!run(GRAVITY, 155) && run(GRAVITY, 12));
    }
}
