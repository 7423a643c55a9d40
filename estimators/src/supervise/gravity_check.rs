//! Gravity check: whether an accelerometer reads about one g, upwards.

use crate::Real;
use crate::api::real::{GRAVITY, lag, sqrt};
use crate::api::snapshot::state;

/// Time constant of the mean of the specific force, s, and the time after which it counts.
const WINDOW_S: Real = 1.0;

/// Smallest and largest size of the mean specific force over g while the vehicle stands, and while it moves: braking at 5 m/s² makes 1.12.
const STANDING: [Real; 2] = [0.95, 1.05];
const MOVING: [Real; 2] = [0.8, 1.25];

/// Smallest share of g along the vertical axis: that of the steepest grade, 60°, is a half.
const MIN_UPRIGHT: Real = 0.5;

/// Gravity check of a three-axis accelerometer: the mean specific force must be g within 5 % standing and within a quarter moving, and its
/// largest part must point up the vertical axis.
///
/// Finds an accelerometer in g for m/s², a vertical axis swapped with another, and all axes of the wrong sign. It does not see a swap of the
/// two horizontal axes, nor a wrong sign of the forward one: both leave gravity as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GravityCheck {
    mean: Option<[Real; 3]>,
    seen_s: Real,
    plausible: bool,
}

impl GravityCheck {
    /// One step of `dt` seconds with the specific force in IMU axes, m/s².
    pub fn observe(&mut self, force_mps2: [Real; 3], standing: bool, dt: Real) {
        let Some(mean) = &mut self.mean else {
            self.mean = Some(force_mps2);
            return;
        };
        let share = lag(dt, WINDOW_S);
        for (mean, now) in mean.iter_mut().zip(force_mps2) {
            *mean += share * (now - *mean);
        }
        self.seen_s = (self.seen_s + dt).min(WINDOW_S);
        let [x, y, z] = *mean;
        let size = sqrt(x * x + y * y + z * z) / GRAVITY;
        let [least, most] = if standing { STANDING } else { MOVING };
        self.plausible = (least..=most).contains(&size) && z > MIN_UPRIGHT * GRAVITY;
    }

    /// Whether the accelerometer may be one in m/s², upright; so too in the first second.
    pub fn plausible(&self) -> bool {
        self.plausible || self.seen_s < WINDOW_S
    }
}

state!(GravityCheck { mean, seen_s, plausible; });

#[cfg(test)]
mod tests {
    use super::*;

    fn plausible(force: [Real; 3], standing: bool) -> bool {
        let mut check = GravityCheck::default();
        assert!(check.plausible());
        for _ in 0..300 {
            check.observe(force, standing, 0.01);
        }
        check.plausible()
    }

    #[test]
    fn one_g_upwards_is_plausible_and_nothing_else() {
        let (sine, cosine) = 0.5f64.sin_cos();
        let slope = [9.81 * sine as Real, 0.0, 9.81 * cosine as Real];
        assert!(plausible(slope, true) && plausible(slope, false));
        let [x, y, z] = slope;
        assert!(!plausible(slope.map(|f| f / 9.81), true)); // in g
        assert!(!plausible([z, y, x], true)); // forward and up swapped
        assert!(!plausible([x, z, y], true)); // left and up swapped
        assert!(!plausible(slope.map(|f| -f), true));
        assert!(plausible([x + 3.0, y, z], false)); // a start at 3 m/s²
        assert!(plausible([0.3, 0.2, 9.7], true)); // an uncalibrated one
    }
}
