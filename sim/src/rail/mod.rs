//! The rail: an analytic curve in space, its I-beam profile, and what hangs on both.

use nalgebra::Vector3;

/// The rail at one chainage: right-handed frame t forward, l left, u up, in the world (z up).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Chainage = arc length in space, m.
    pub s: f64,
    /// Position of the rail's line, m.
    pub p: Vector3<f64>,
    /// Unit tangent (cos θ cos ψ, cos θ sin ψ, sin θ).
    pub t: Vector3<f64>,
    /// Unit left, horizontal.
    pub l: Vector3<f64>,
    /// Unit up, t × l.
    pub u: Vector3<f64>,
    /// Curvature vector dt/ds, 1/m.
    pub k: Vector3<f64>,
}
