//! The interface of a controller: reference and perception in, command out.

use super::{Perception, Reference};
use monorig_estimators::api::signals::Command;

/// Computes the command of each step of the plant. A crate of its own can implement it and add it to a
/// [`Registry`](crate::closed_loop::registry::Registry), or hand one to a
/// [`SimulationBuilder`](crate::closed_loop::builder::SimulationBuilder).
pub trait Controller {
    /// The command for the next `dt_s` seconds. [`Reference::command`] is where to start: it holds the clamp pressure
    /// and the emergency brake that are asked for, and no torque.
    fn control(&mut self, reference: &Reference, perception: &Perception, dt_s: f64) -> Command;

    /// Reason why the controller cannot go on, if there is one: the run then ends, and its last command has no effect.
    fn broken(&self) -> Option<&str> {
        None
    }
}

/// Data for which a controller is built, beside the nominal vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct ControllerSetup {
    /// Largest torque of each motor, N·m.
    pub motor_torque_max_nm: f64,
    /// Gravity, m/s².
    pub gravity_mps2: f64,
    /// Speed at the start, m/s.
    pub start_speed_mps: f64,
}
