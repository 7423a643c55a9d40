//! Perception: what the controller is told about the train.

use monorig_estimators::signals::MAX_DRIVES;

/// What the controller is told about the train.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Perception {
    /// Speed along the rail, m/s.
    pub speed_mps: f64,
    /// Grade for the feed-forward, rad; 0 without one.
    pub grade_rad: f64,
    /// Total mass for the feed-forward, kg; the nominal one without.
    pub total_mass_kg: f64,
    /// Whether grade and mass are known now, and not held or nominal values.
    pub vouched: bool,
    /// Wheel speed of each drive unit minus the speed, m/s: what spins or locks.
    pub slip_mps: [f64; MAX_DRIVES],
}
