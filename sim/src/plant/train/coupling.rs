//! Couplings, hangers and chains: spring-dampers between two bodies.

use super::body_state::BodyState;
use crate::train::{Connection, ConnectionKind};
use nalgebra::Vector3;

/// Force on body `a` (the opposite force acts on `b`), N, its two points of action, m, and the power lost in the
/// damper, W.
pub struct Pull {
    /// Force on `a`.
    pub force: Vector3<f64>,
    /// Anchor on `a` in the world.
    pub at_a: Vector3<f64>,
    /// Anchor on `b` in the world.
    pub at_b: Vector3<f64>,
    /// Power lost, W.
    pub loss: f64,
}

/// Forces and torques of a connection on its two bodies.
pub fn pull(c: &Connection, a: &BodyState, b: &BodyState) -> Pull {
    let at_a = a.point(&c.anchor_a);
    let at_b = b.point(&c.anchor_b);
    let d = at_b - at_a;
    let v = b.velocity(&at_b) - a.velocity(&at_a);
    let (force, loss) = match c.kind {
        ConnectionKind::Hanger => (d * c.k + v * c.c, c.c * v.norm_squared()),
        ConnectionKind::Drawbar | ConnectionKind::Chain => {
            let length = d.norm_squared().sqrt();
            if length < 1e-9 {
                (Vector3::zeros(), 0.0)
            } else {
                let n = d / length;
                let rate = n.dot(&v);
                let tension = c.k * (length - c.length_m) + c.c * rate;
                let slack =
                    c.kind == ConnectionKind::Chain && (length <= c.length_m || tension <= 0.0);
                if slack {
                    (Vector3::zeros(), 0.0)
                } else {
                    (n * tension, c.c * rate * rate)
                }
            }
        }
    };
    Pull {
        force,
        at_a,
        at_b,
        loss,
    }
}

/// Energy stored in the spring, J.
pub fn stored(c: &Connection, a: &BodyState, b: &BodyState) -> f64 {
    let d = b.point(&c.anchor_b) - a.point(&c.anchor_a);
    let x = match c.kind {
        ConnectionKind::Hanger => d.norm(),
        ConnectionKind::Drawbar => d.norm() - c.length_m,
        ConnectionKind::Chain => (d.norm() - c.length_m).max(0.0),
    };
    0.5 * c.k * x * x
}
