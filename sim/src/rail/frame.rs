//! The frame of the rail at a chainage, and the place of the last frame.

use nalgebra::Vector3;

/// The rail at one chainage: right-handed frame t forward, l left, u up, in the world (z up).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RailFrame {
    /// Chainage = arc length in space, m.
    pub s: f64,
    /// Position of the rail's line (middle of the web, half height of the beam), m.
    pub p: Vector3<f64>,
    /// Unit tangent (cos θ cos ψ, cos θ sin ψ, sin θ).
    pub t: Vector3<f64>,
    /// Unit left, horizontal.
    pub l: Vector3<f64>,
    /// Unit up, t × l.
    pub u: Vector3<f64>,
    /// Curvature vector dt/ds = κ_h cos θ l + κ_v u, 1/m.
    pub k: Vector3<f64>,
}

impl RailFrame {
    /// Complete a frame from the curve's derivatives.
    pub(crate) fn new(s: f64, p: Vector3<f64>, t: Vector3<f64>, k: Vector3<f64>) -> Self {
        let [l, u] = across(&t);
        Self { s, p, t, l, u, k }
    }
}

/// Left and up of a tangent.
#[inline]
pub(super) fn across(t: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let level = 1.0 / (t.x * t.x + t.y * t.y).sqrt();
    let l = Vector3::new(-t.y * level, t.x * level, 0.0);
    // t × l with l.z = 0, written out
    let u = Vector3::new(-t.z * l.y, t.z * l.x, t.x * l.y - t.y * l.x);
    [l, u]
}

/// Place on the rail in the last call: the warm start of [`crate::rail::Rail::track`] and
/// [`crate::rail::Rail::project`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cursor {
    /// Chainage, m.
    pub s: f64,
    /// The node that holds it: only a hint, any value is safe.
    pub(crate) node: usize,
    /// The same of the line without the steps of joints.
    pub(super) smooth: usize,
}

impl Cursor {
    /// A cursor at a chainage, m.
    pub fn at(s: f64) -> Self {
        Self {
            s,
            ..Self::default()
        }
    }
}

/// Number of pieces of at most `step` that make up `length`: at least one, at most ten million.
pub(crate) fn pieces(length: f64, step: f64) -> usize {
    const MAX_PIECES: f64 = 1e7;
    if step > 0.0 && length > 0.0 {
        // a sliver of rounding at the end is no piece of its own
        (length / step - 1e-9).ceil().clamp(1.0, MAX_PIECES) as usize
    } else {
        1
    }
}
