//! The validity rule, one for all robust estimators.
//!
//! A value is valid while
//!
//! 1. what it rests on is there: fresh inputs, a force balance that holds, wheels that do not slip, a grade that is observable
//! 2. no limit acts on it
//! 3. its standard deviation is below a limit ([`MAX_GRADE_SD_RAD`], [`MAX_MASS_SD_SHARE`]; none for speed)

use crate::Real;
use crate::api::signals::Estimate;

/// Largest standard deviation of a valid grade angle, rad.
pub const MAX_GRADE_SD_RAD: Real = 0.05;

/// Largest standard deviation of a valid mass, as a share of it, from a regression that leaves resistance and bias free: twice that is a
/// tenth.
pub const MAX_MASS_SD_SHARE: Real = 0.05;

/// The same from a method that takes them as known, and is coarser for it.
pub const MAX_COARSE_MASS_SD_SHARE: Real = 0.1;

/// The validity rule: `basis` is points 1 and 2, `sd` and `max_sd` point 3.
pub fn is_valid(basis: bool, sd: Real, max_sd: Real) -> bool {
    basis && sd < max_sd
}

/// Validity gate: the last piece of an estimator; off, it marks all estimated values as valid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValidityGate {
    on: bool,
}

impl ValidityGate {
    /// On or off.
    pub fn new(on: bool) -> Self {
        Self { on }
    }

    /// The estimate as it is published; its marks are by the rule. `mass`: whether a mass is estimated at all.
    pub fn publish(&self, mut estimate: Estimate, mass: bool) -> Estimate {
        estimate.total_mass_kg.valid |= mass && !self.on;
        for value in [
            &mut estimate.grade_rad,
            &mut estimate.effective_grade_rad,
            &mut estimate.speed_mps,
        ] {
            value.valid |= !self.on;
        }
        estimate
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn off_it_marks_all_that_is_estimated() {
        let marks = |on: bool, mass: bool| {
            let estimate = ValidityGate::new(on).publish(Estimate::default(), mass);
            [
                estimate.total_mass_kg,
                estimate.grade_rad,
                estimate.effective_grade_rad,
                estimate.speed_mps,
            ]
            .map(|value| value.valid)
        };
        assert_eq!(marks(true, true), [false; 4]);
        assert_eq!(marks(false, true), [true; 4]);
        assert_eq!(marks(false, false), [false, true, true, true]);
        assert!(is_valid(true, 0.04, MAX_GRADE_SD_RAD) && !is_valid(false, 0.04, MAX_GRADE_SD_RAD));
        assert!(!is_valid(true, 0.05, MAX_GRADE_SD_RAD));
    }
}
