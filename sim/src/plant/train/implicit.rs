//! The change of all velocities in a step, with springs and dampers implicit.
//!
//! ```text
//! M Δv = dt F(x + dt/2 v + β dt Δv,  v + Δv/2)              x, v before the step
//! Δv = Δv′ + ε,   (M + dt/2 C + β dt² K) ε = dt F′ − M Δv′
//! ```
//!
//! That is Newmark's method with γ = 1/2 and some β, of second order, solved by one step of Newton's method from the
//! change Δv′ of the last step, with which the forces F′ are evaluated. K and C are those of all springs of the train on a
//! straight rail, wheels pressed and shoes off, in the frames of the bodies: what ε then takes from each force, it takes by
//! the state that the contact truly has. The bodies are a tree along the train, and are eliminated towards its root.

use super::body_state::{BodyState, Wrench};
use crate::train::Train;
use crate::train::springs::{SPRING_SHARE, Spring};
use nalgebra::{Matrix6, Vector3, Vector6};

/// Returns dt/2 c + β dt² k over dt: what each m/s of ε takes from the force of a spring, N·s/m.
pub(super) fn yielding(k: f64, c: f64, dt: f64) -> f64 {
    0.5 * c + SPRING_SHARE * dt * k
}

/// A body in the tree.
#[derive(Clone, Debug)]
struct Node {
    body: usize,
    parent: Option<usize>,
    /// Inverse of the matrix of the body when those below it are eliminated, that times its block to the parent, and the
    /// transpose of this.
    inverse: Matrix6<f64>,
    up: Matrix6<f64>,
    down: Matrix6<f64>,
}

/// Solution for steps of one length.
#[derive(Clone, Debug, Default)]
pub(crate) struct Implicit {
    dt: f64,
    /// Each body before its parent.
    nodes: Vec<Node>,
    rests: Vec<Vector6<f64>>,
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
            *rest = Vector6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z);
        }
        for n in &self.nodes {
            if let Some(parent) = n.parent {
                let eliminated = n.down * self.rests[n.body];
                self.rests[parent] -= eliminated;
            }
        }
        for n in self.nodes.iter().rev() {
            let mut more = n.inverse * self.rests[n.body];
            if let Some(parent) = n.parent {
                more -= n.up * self.rests[parent];
            }
            self.rests[n.body] = more;
            let r = &bodies[n.body].r;
            self.more[n.body] = [r * more.fixed_rows::<3>(0), r * more.fixed_rows::<3>(3)];
        }
    }

    fn new(train: &Train, dt: f64) -> Self {
        let (count, springs) = (train.bodies.len(), train.springs());
        let coupled = |i: usize, j: usize| -> Matrix6<f64> {
            let each = |s: &Spring| s.rate(i) * s.rate(j).transpose() * (s.yielding(dt) * dt);
            springs.iter().map(each).sum()
        };
        let mut blocks = train.masses();
        for (i, block) in blocks.iter_mut().enumerate() {
            *block += coupled(i, i);
        }
        // From each root on, whatever is joined to what is there.
        let mut order: Vec<(usize, Option<usize>)> = Vec::new();
        for _ in &blocks {
            let there = |i: &usize| order.iter().any(|n| n.0 == *i);
            let parent = |i: usize| springs.iter().filter_map(|s| s.other(i)).find(there);
            let rest = || (0..blocks.len()).filter(|i| !there(i));
            let next = rest().find(|i| parent(*i).is_some());
            if let Some(next) = next.or_else(|| rest().next()) {
                let node = (next, parent(next));
                order.push(node);
            }
        }
        let mut nodes = Vec::new();
        for (body, parent) in order.into_iter().rev() {
            let inverse = blocks[body].try_inverse().unwrap_or_default();
            let joint = parent.map_or_else(Matrix6::zeros, |p| coupled(body, p));
            let up = inverse * joint;
            if let Some(parent) = parent {
                blocks[parent] -= joint.tr_mul(&up);
            }
            // Without a force of their own, friction wheels only lessen the blocks of their bodies.
            if body < count {
                nodes.push(Node {
                    body,
                    parent,
                    inverse,
                    up,
                    down: up.transpose(),
                });
            }
        }
        Self {
            dt,
            nodes,
            rests: vec![Vector6::zeros(); count],
            more: vec![[Vector3::zeros(); 2]; count],
        }
    }
}
