//! Measured error of the grade at the IMU, which is carried ahead from the unit's middle: when the middle has come to
//! where the IMU was, the grade there is known.
//!
//! The grade at the IMU is θ + l_x κ, and how κ changes over the arm l_x is not known before: 0.045 m² dκ/ds for 0.3 m.
//! A rail with many transitions has a larger error than a straight one, and the reported standard deviation follows
//! what has been seen.

use crate::Real;
use crate::api::real::sqrt;
use crate::api::snapshot::state;

/// Predictions kept along the arm.
const PLACES: usize = 4;
/// Way over which a large error is remembered, m.
const MEMORY_M: Real = 8.0;
/// Error of a curvature that is known, as an uncertainty of the arm, m: the curvature lags by 0.05 m of way.
const LAG_M: Real = 0.05;

/// Measured error of the arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmError {
    arm_m: Real,
    ring: [Option<Real>; PLACES],
    next: usize,
    way_m: Real,
    variance: Real,
}

impl ArmError {
    /// Builds the estimate of the error for an arm of `arm_m`.
    pub fn new(arm_m: Real) -> Self {
        Self {
            arm_m,
            ring: [None; PLACES],
            next: 0,
            way_m: 0.0,
            variance: 0.0,
        }
    }

    /// Takes a step of `way_m` at the pitch `theta` (`None` if it is not known closely) in a curve of `kappa`.
    pub fn step(&mut self, way_m: Real, theta: Option<Real>, kappa: Real) {
        let part_m = self.arm_m / PLACES as Real;
        self.way_m += way_m;
        if part_m <= 0.0 || self.way_m.abs() < part_m {
            return;
        }
        let Some(theta) = theta.filter(|_| self.way_m > 0.0) else {
            // Going back nothing is ahead: the rail was read before.
            self.ring = [None; PLACES];
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
                let keep = 1.0 - part_m / MEMORY_M;
                self.variance = (keep * self.variance).max(error * error * PEAK);
            }
        }
        self.next = (self.next + 1) % PLACES;
    }

    /// Standard deviation of the grade at the IMU from the arm, rad, in a curve of `kappa`.
    pub fn sd_rad(&self, kappa: Real) -> Real {
        let lag = LAG_M * kappa;
        sqrt(self.variance + lag * lag)
    }
}

/// Share of the largest recent square that counts as a variance: an error that comes and goes with each transition
/// peaks at twice its root mean square.
const PEAK: Real = 0.25;

state!(ArmError { ring, next, way_m, variance; arm_m } where |this| this.next < PLACES);
