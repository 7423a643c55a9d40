//! Observability of the grade by the force balance.

use crate::Real;
use crate::api::snapshot::state;
use crate::tuning::OBSERVABILITY;

/// Observability of the grade: lost by dead reckoning (moving under the brake or without torque, where the force
/// balance does not hold), back once the filter has found the grade again.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GradeObservability {
    dead_reckoning: bool,
}

impl GradeObservability {
    /// Notes that the train has moved without a force balance.
    pub fn lose(&mut self) {
        self.dead_reckoning = true;
    }

    /// Notes the variance of the grade after a measurement, rad².
    pub fn update(&mut self, grade_variance: Real) {
        self.dead_reckoning &=
            grade_variance > OBSERVABILITY.found_sd_rad * OBSERVABILITY.found_sd_rad;
    }

    /// Returns true if the grade has been found since the train last moved by dead reckoning.
    pub fn grade_observable(&self) -> bool {
        !self.dead_reckoning
    }
}

state!(GradeObservability { dead_reckoning; });

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lost_by_dead_reckoning_and_found_by_measurements() {
        let mut grade = GradeObservability::default();
        assert!(grade.grade_observable());
        grade.update(1.0);
        assert!(grade.grade_observable());
        grade.lose();
        grade.update(2e-4);
        assert!(!grade.grade_observable());
        grade.update(0.5e-4);
        assert!(grade.grade_observable());
    }
}
