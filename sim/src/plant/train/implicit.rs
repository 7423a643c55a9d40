//! The change of all velocities in a step, with springs and dampers implicit.
//!
//! ```text
//! M Δv = dt F(x + dt/2 v + β dt Δv,  v + Δv/2)              x, v before the step
//! Δv = Δv′ + ε,   (M + dt/2 C + β dt² K) ε = dt F′ − M Δv′
//! ```
//!
//! That is Newmark's method with γ = 1/2 and some β, of second order, solved by one step of Newton's method from the
//! change Δv′ of the last step, with which the forces F′ are evaluated. K and C are those of all springs of the train
//! on a straight rail, wheels pressed and shoes off, in the frames of the bodies, without what joins the motion in the
//! upright plane to that across it: what ε then takes from each force, it takes by the state that the contact truly
//! has. The bodies are a tree along the train, and are eliminated towards its root.

use super::body_state::{BodyState, Wrench};
use crate::train::Train;
use crate::train::springs::{SPRING_SHARE, Spring};
use nalgebra::{Matrix3, Matrix6, Vector3};

/// Coordinates of a body that move it in the upright plane along the rail (ahead, up, pitch), and across (left, roll,
/// yaw).
const PLANES: [[usize; 3]; 2] = [[0, 2, 4], [1, 3, 5]];

/// Returns dt/2 c + β dt² k over dt: what each m/s of ε takes from the force of a spring, N·s/m.
pub(super) fn yielding(k: f64, c: f64, dt: f64) -> f64 {
    0.5 * c + SPRING_SHARE * dt * k
}

/// A body in the tree, in both planes.
#[derive(Clone, Debug)]
struct TreeNode {
    body: usize,
    parent: Option<usize>,
    /// Inverse of the matrix of the body when those below it are eliminated, and that times its block to the parent.
    inverse: [Matrix3<f64>; 2],
    up: [Matrix3<f64>; 2],
}

/// Solution for steps of one length.
#[derive(Clone, Debug, Default)]
pub(crate) struct Implicit {
    dt: f64,
    /// Each body before its parent.
    nodes: Vec<TreeNode>,
    rests: Vec<[Vector3<f64>; 2]>,
    /// ε of each body, linear and angular, in the world, m/s and rad/s.
    pub more: Vec<[Vector3<f64>; 2]>,
}

impl Implicit {
    /// Forgets the masses of the train.
    pub fn reset(&mut self) {
        self.dt = 0.0;
    }

    /// Adds the gyroscopic torque to the wrenches of a step of `dt` (s), and finds ε.
    pub fn solve(
        &mut self,
        train: &Train,
        bodies: &[BodyState],
        gravity: f64,
        dt: f64,
        out: &mut [Wrench],
    ) {
        if self.dt != dt {
            *self = Self::new(train, dt);
        }
        for (((s, body), wrench), rest) in bodies
            .iter()
            .zip(&train.bodies)
            .zip(out.iter_mut())
            .zip(&mut self.rests)
        {
            let local = |v: &Vector3<f64>| s.r.tr_mul(v);
            let (w, [dv, dw]) = (local(&s.w), s.gained);
            wrench.torque -= s.r * w.cross(&(body.inertia * w));
            let mut force = wrench.force * dt - dv * body.mass_kg;
            force.z -= gravity * body.mass_kg * dt;
            let force = local(&force);
            let torque = local(&wrench.torque) * dt - body.inertia * local(&dw);
            *rest = [
                Vector3::new(force.x, force.z, torque.y),
                Vector3::new(force.y, torque.x, torque.z),
            ];
        }
        for n in &self.nodes {
            if let Some(parent) = n.parent {
                let rest = self.rests[n.body];
                for plane in [0, 1] {
                    self.rests[parent][plane] -= n.up[plane].tr_mul(&rest[plane]);
                }
            }
        }
        for n in self.nodes.iter().rev() {
            let mut more = [0, 1].map(|plane| n.inverse[plane] * self.rests[n.body][plane]);
            if let Some(parent) = n.parent {
                for plane in [0, 1] {
                    more[plane] -= n.up[plane] * self.rests[parent][plane];
                }
            }
            self.rests[n.body] = more;
            let [along, across] = more;
            let r = &bodies[n.body].r;
            self.more[n.body] = [
                r * Vector3::new(along.x, across.x, along.y),
                r * Vector3::new(across.y, along.z, across.z),
            ];
        }
    }

    fn new(train: &Train, dt: f64) -> Self {
        let (count, springs) = (train.bodies.len(), train.springs());
        let coupled = |i: usize, j: usize| -> Matrix6<f64> {
            let each = |s: &Spring| s.rate(i) * s.rate(j).transpose() * (s.yielding(dt) * dt);
            springs.iter().map(each).sum()
        };
        let masses = train.masses().into_iter().enumerate();
        let mut blocks: Vec<_> = masses.map(|(i, m)| planes(&(m + coupled(i, i)))).collect();
        let mut order = Vec::new();
        for root in 0..blocks.len() {
            grow(&springs, (root, None), &mut order);
        }
        let mut nodes = Vec::new();
        for (body, parent) in order.into_iter().rev() {
            let inverse = blocks[body].map(|b| b.try_inverse().unwrap_or_default());
            let joint = planes(&parent.map_or_else(Matrix6::zeros, |p| coupled(body, p)));
            let up = [0, 1].map(|plane| inverse[plane] * joint[plane]);
            if let Some(parent) = parent {
                for plane in [0, 1] {
                    blocks[parent][plane] -= joint[plane].tr_mul(&up[plane]);
                }
            }
            // Without a force of their own, friction wheels only lessen the blocks of their bodies.
            if body < count {
                nodes.push(TreeNode {
                    body,
                    parent,
                    inverse,
                    up,
                });
            }
        }
        Self {
            dt,
            nodes,
            rests: vec![[Vector3::zeros(); 2]; count],
            more: vec![[Vector3::zeros(); 2]; count],
        }
    }
}

/// Adds a body with its parent, and all that springs join to it, to an order in which each body is behind its parent.
fn grow(springs: &[Spring], node: (usize, Option<usize>), order: &mut Vec<(usize, Option<usize>)>) {
    if order.iter().any(|n| n.0 == node.0) {
        return;
    }
    order.push(node);
    for next in springs.iter().filter_map(|s| s.other(node.0)) {
        grow(springs, (next, Some(node.0)), order);
    }
}

/// Returns the part of a matrix of a body in each of the planes.
fn planes(m: &Matrix6<f64>) -> [Matrix3<f64>; 2] {
    PLANES.map(|plane| Matrix3::from_fn(|i, j| m[(plane[i], plane[j])]))
}
