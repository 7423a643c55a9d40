//! Measured error of the grade at the IMU, which is carried ahead from the unit's middle: when the middle has come to
//! where the IMU was, the grade there is known.
//!
//! The grade at the IMU is θ + l_x κ, and how κ changes over the arm l_x is not known before: 0.045 m² dκ/ds for 0.3 m.
//! A rail with many transitions has a larger error than a straight one, and the reported standard deviation follows
//! what has been seen.

use crate::Real;
use crate::api::real::sqrt;
use crate::api::snapshot::state;
use crate::tuning::{ARM, CURVATURE};

/// Measured error of the arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmError {
    arm_m: Real,
    ring: [Option<Real>; ARM.places],
    next: usize,
    way_m: Real,
    variance: Real,
}

impl ArmError {
    /// Builds the estimate of the error for an arm of `arm_m`.
    pub fn new(arm_m: Real) -> Self {
        Self {
            arm_m,
            ring: [None; ARM.places],
            next: 0,
            way_m: 0.0,
            variance: 0.0,
        }
    }

    /// Takes a step of `way_m` at the pitch `theta` (`None` if it is not known well) in a curve of `kappa`.
    pub fn step(&mut self, way_m: Real, theta: Option<Real>, kappa: Real) {
        let part_m = self.arm_m / ARM.places as Real;
        self.way_m += way_m;
        if part_m <= 0.0 || self.way_m.abs() < part_m {
            return;
        }
        let Some(theta) = theta.filter(|_| self.way_m > 0.0) else {
            // Going back nothing is ahead: the rail was read before.
            self.ring = [None; ARM.places];
            self.way_m = 0.0;
            return;
        };
        self.way_m -= part_m;
        if self.way_m > part_m {
            self.way_m = 0.0;
        }
        if let Some(place) = self.ring.get_mut(self.next) {
            let predicted = place.replace(theta + self.arm_m * kappa);
            if let Some(predicted) = predicted {
                let error = theta - predicted;
                let keep = 1.0 - part_m / ARM.memory_m;
                self.variance = (keep * self.variance).max(error * error * ARM.peak);
            }
        }
        self.next = (self.next + 1) % ARM.places;
    }

    /// Standard deviation of the grade at the IMU from the arm, rad, in a curve of `kappa`.
    pub fn sd_rad(&self, kappa: Real) -> Real {
        let lag = CURVATURE.memory_m * kappa;
        sqrt(self.variance + lag * lag)
    }
}

state!(ArmError { ring, next, way_m, variance; arm_m } where |this| this.next < ARM.places);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::real::exp;

    const ARM_M: Real = 0.3;
    const STEP_M: Real = 0.005;

    /// Goes on over a rail of the grade `grade(s)`, whose curvature is told to be `kappa`; returns the way gone, m.
    fn go(
        arm: &mut ArmError,
        from_m: Real,
        way_m: Real,
        grade: impl Fn(Real) -> Real,
        kappa: Real,
    ) -> Real {
        let (steps, mut at_m) = ((way_m.abs() / STEP_M) as usize, from_m);
        for _ in 0..steps {
            at_m += way_m.signum() * STEP_M;
            arm.step(way_m.signum() * STEP_M, Some(grade(at_m)), kappa);
        }
        at_m
    }

    /// On a rail of 0.1 rad/m that is taken for straight, the grade carried ahead over the arm is wrong by 0.03 rad,
    /// of which a half is reported. Told the curvature, it is right, and what is left is the lag of the curvature.
    #[test]
    fn half_of_the_largest_error_is_reported() {
        let rail = |s: Real| 0.1 * s;
        let mut arm = ArmError::new(ARM_M);
        let at_m = go(&mut arm, 0.0, 0.9 * ARM_M, rail, 0.0);
        assert_eq!(arm.sd_rad(0.0), 0.0, "nothing has been compared yet");
        go(&mut arm, at_m, 2.0, rail, 0.0);
        let sd = arm.sd_rad(0.0);
        assert!((sd / (0.5 * 0.1 * ARM_M) - 1.0).abs() < 0.1, "{sd}");
        let mut told = ArmError::new(ARM_M);
        go(&mut told, 0.0, 2.0, rail, 0.1);
        assert!(told.sd_rad(0.0) < 0.1 * sd);
        assert!((told.sd_rad(-0.1) / (0.1 * CURVATURE.memory_m) - 1.0).abs() < 0.1);
    }

    /// Over the memory in way the variance of a large error falls to 1/e of it.
    #[test]
    fn an_error_is_forgotten_over_the_way() {
        let mut arm = ArmError::new(ARM_M);
        let at_m = go(&mut arm, 0.0, 2.0, |s| 0.1 * s, 0.0);
        let at_m = go(&mut arm, at_m, 1.0, |_| 0.2, 0.0);
        let before = arm.sd_rad(0.0);
        go(&mut arm, at_m, ARM.memory_m, |_| 0.2, 0.0);
        let left = arm.sd_rad(0.0) / before;
        assert!((left / exp(-0.5) - 1.0).abs() < 0.02, "{left}");
    }

    /// The rail jumps by 0.1 rad while the unit goes back, or while its pitch is not known: no prediction made before
    /// counts after.
    #[test]
    fn what_was_predicted_before_going_back_or_a_gap_does_not_count() {
        for back in [true, false] {
            let mut arm = ArmError::new(ARM_M);
            let at_m = go(&mut arm, 0.0, 2.0, |_| 0.0, 0.0);
            if back {
                go(&mut arm, at_m, -0.2, |_| 0.0, 0.0);
            } else {
                (0..20).for_each(|_| arm.step(STEP_M, None, 0.0));
            }
            go(&mut arm, at_m, 2.0, |_| 0.1, 0.0);
            assert_eq!(arm.sd_rad(0.0), 0.0, "{back}");
        }
    }

    #[test]
    fn without_an_arm_there_is_no_error() {
        let mut arm = ArmError::new(0.0);
        go(&mut arm, 0.0, 2.0, |s| (20.0 * s).sin(), 0.0);
        assert_eq!(arm.sd_rad(0.0), 0.0);
    }
}
