//! Running resistance of a rail-bound body, term by term. The "running-resistance coefficient" that estimators speak of is
//! an outcome of these, not an input.

use super::{Resistance, running_gear::Grip};

/// Speed over which a resistance builds up around standstill, m/s.
const STICTION_SPEED: f64 = 0.01;

/// Direction of a motion, −1…1, smooth through standstill.
pub fn direction(v: f64) -> f64 {
    let x = v / STICTION_SPEED;
    if x >= 1.0 {
        1.0
    } else if x <= -1.0 {
        -1.0
    } else {
        1.5 * x - 0.5 * x * x * x
    }
}

/// Rolling of the running wheels and of the guide wheels at one station, N against the motion. Guide forces grow in curves:
/// that is the curve resistance.
pub fn rolling(r: &Resistance, g: &Grip) -> f64 {
    direction(g.v_t) * (r.running_wheel * g.wheel_load + r.guide_wheel * g.guide_load)
}

/// Bearings of one rail-bound body, N against the motion.
pub fn bearing(r: &Resistance, v: f64) -> f64 {
    direction(v) * r.bearing_n + r.bearing_nspm * v
}

/// Air drag of the train, N against the motion.
pub fn air(r: &Resistance, v: f64) -> f64 {
    r.air_nspm2 * v * v.abs()
}

/// Torque that the clamp force puts against a friction wheel's rolling, N·m (radius `radius` m, clamp force `clamp` N).
pub fn clamped_wheel(r: &Resistance, clamp: f64, radius: f64, omega: f64) -> f64 {
    direction(omega * radius) * r.clamped_wheel * clamp * radius
}
