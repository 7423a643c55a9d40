//! Couplings, hangers and chains: spring-dampers between two bodies.

use super::body_state::BodyState;
use super::implicit::yielding;
use crate::train::{Connection, ConnectionKind};
use nalgebra::Vector3;

/// Force on body `a` (the opposite force acts on `b`), N, its two points of action, m, and the power lost in the
/// damper, W.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pull {
    /// Force on `a`.
    pub force: Vector3<f64>,
    /// Anchor on `a` in the world.
    pub at_a: Vector3<f64>,
    /// Anchor on `b` in the world.
    pub at_b: Vector3<f64>,
    /// Power lost, W.
    pub loss: f64,
    /// Direction of a drawbar or chain; zero if it is slack, and for a hanger.
    along: Vector3<f64>,
}

/// Forces and torques of a connection on its two bodies.
pub fn pull(c: &Connection, a: &BodyState, b: &BodyState) -> Pull {
    let at_a = a.point(&c.anchor_a);
    let at_b = b.point(&c.anchor_b);
    let d = at_b - at_a;
    let v = b.velocity(&at_b) - a.velocity(&at_a);
    let still = Pull {
        at_a,
        at_b,
        ..Pull::default()
    };
    if c.kind == ConnectionKind::Hanger {
        return Pull {
            force: d * c.k + v * c.c,
            loss: c.c * v.norm_squared(),
            ..still
        };
    }
    let length = d.norm_squared().sqrt();
    if length < 1e-9 {
        return still;
    }
    let n = d * (1.0 / length);
    let rate = n.dot(&v);
    let tension = c.k * (length - c.length_m) + c.c * rate;
    if c.kind == ConnectionKind::Chain && (length <= c.length_m || tension <= 0.0) {
        return still;
    }
    Pull {
        force: n * tension,
        loss: c.c * rate * rate,
        along: n,
        ..still
    }
}

impl Pull {
    /// Returns what the force on `a` gains if the anchors part by `more` (m/s) faster than expected at the end of a
    /// step of `dt` (s).
    pub fn gains(&self, c: &Connection, more: &Vector3<f64>, dt: f64) -> Vector3<f64> {
        let rate = match c.kind {
            ConnectionKind::Hanger => *more,
            ConnectionKind::Drawbar | ConnectionKind::Chain => self.along * self.along.dot(more),
        };
        rate * yielding(c.k, c.c, dt)
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
