//! The true grade to compare a lagged grade with.

use monorig_sim::closed_loop::Simulation;
use monorig_sim::rail::{Cursor, Rail};
use std::sync::Arc;

/// True grade of the rail under the middle of the unit that carries the IMU: where the IMU was when it was one arm
/// further back. With kinks and steps of joints, as the grade at the IMU.
#[derive(Clone)]
pub(crate) struct GradeAtMiddle {
    rail: Arc<Rail>,
    arm_m: f64,
    cursor: Cursor,
}

impl GradeAtMiddle {
    /// The true grade of a simulation, with the arm from the parameters of its estimators.
    pub(crate) fn of(simulation: &Simulation) -> Self {
        Self {
            rail: Arc::clone(&simulation.rail),
            arm_m: simulation.vehicle.imu_arm_m,
            cursor: Cursor::at(0.0),
        }
    }

    /// Grade with the IMU at this chainage, m: rad. Not a number where the chainage is not known, as in a recorded
    /// drive.
    pub(crate) fn at(&mut self, chainage_m: f64) -> f64 {
        if !chainage_m.is_finite() {
            return f64::NAN;
        }
        let place = chainage_m - self.arm_m;
        let along = self.rail.frame_at(place, &mut self.cursor).t;
        libm::asin(along.z.clamp(-1.0, 1.0))
    }
}
