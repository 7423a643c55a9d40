//! Running resistance of a rail-bound body, term by term. The "running-resistance coefficient" that estimators speak of
//! is an outcome of these, not an input.

use super::friction::Bristle;
use super::running_gear::Grip;
use crate::train::{Body, Resistance, Train};

/// Speed over which a resistance builds up around standstill, m/s.
const STICTION_SPEED_MPS: f64 = 0.01;

/// Direction of a motion, −1…1, smooth through standstill.
pub fn direction(v: f64) -> f64 {
    let x = v / STICTION_SPEED_MPS;
    if x >= 1.0 {
        1.0
    } else if x <= -1.0 {
        -1.0
    } else {
        1.5 * x - 0.5 * x * x * x
    }
}

/// Pre-rolling of a station: rolling resistance builds up over a millimetre of way, so that a train at rest is held by
/// it.
pub const ROLLING: Bristle = Bristle {
    sigma0: 1.0e6,
    sigma1: 2.0e3,
    kappa: 0.0,
    radius: 0.0,
    inertia: f64::INFINITY,
};

/// Largest rolling resistance of the running wheels, and of the guide wheels, at one station, N. Guide forces grow in
/// curves: that is the curve resistance.
pub fn rolling(r: &Resistance, g: &Grip) -> [f64; 2] {
    let [left, right, guide] = g.loads.map(f64::abs);
    [r.running_wheel * (left + right), r.guide_wheel * guide]
}

/// Bearings of one rail-bound body, N against the motion.
pub fn bearing(r: &Resistance, v: f64) -> f64 {
    direction(v) * r.bearing_n + r.bearing_nspm * v
}

/// Air drag of the train, N against the motion.
pub fn air(r: &Resistance, v: f64) -> f64 {
    r.air_nspm2 * v * v.abs()
}

/// Rolling-resistance torque of a friction wheel under clamp force, N·m (radius `radius` m, clamp force `clamp` N).
pub fn clamped_wheel(r: &Resistance, clamp: f64, radius: f64, omega: f64) -> f64 {
    direction(omega * radius) * r.clamped_wheel * clamp * radius
}

/// Largest gain of the torque of [`clamped_wheel`] for each rad/s, N·m·s.
pub fn clamped_damping(r: &Resistance, clamp: f64, radius: f64, omega: f64) -> f64 {
    if (omega * radius).abs() >= STICTION_SPEED_MPS {
        return 0.0;
    }
    1.5 * r.clamped_wheel * clamp * radius * radius / STICTION_SPEED_MPS
}

impl Train {
    /// Number of bodies on the rail.
    pub(crate) fn rail_bound(&self) -> f64 {
        let bound = |b: &&Body| !b.stations.is_empty();
        self.bodies.iter().filter(bound).count() as f64
    }

    /// Running-resistance coefficient of the data sheet at a total mass (kg) on the level, straight rail: all terms at
    /// a slow steady speed over the weight.
    pub fn nominal_running_resistance(&self, total_mass_kg: f64, gravity: f64) -> f64 {
        let weight = total_mass_kg * gravity;
        let bound = self.rail_bound();
        let clamped: f64 = self
            .drives
            .iter()
            .map(|d| 2.0 * d.clamp_mpa * 1e6 * d.piston_area_m2)
            .sum();
        let r = &self.resistance;
        (r.running_wheel * weight + bound * r.bearing_n + r.clamped_wheel * clamped) / weight
    }
}
