//! Running gear over a step: the stiffest springs of the train, on its lightest bodies.
//!
//! ```text
//! (M + dt/2 C + dt²/12 K) Δv = dt F + dt/2 C Δv′        M Δv/dt = F − A F + (1 − A) C Δv′/2
//! ```
//!
//! for each rail-bound body, with M its mass, K and C stiffness and damping of its wheels, F the force with places and
//! velocities as in `body_state.rs`, and Δv′ the change of velocity in the last step. That is the method of Fox and Goodwin
//! (1949), which is Newmark's with β = 1/12 and γ = 1/2: periods of the springs are right to the fourth order, and the
//! dampers take nothing from the longest step. K and C are those of pressed wheels on a straight rail.

use super::body_state::{BodyState, Wrench};
use crate::train::Train;
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

/// A force that is implicit in its own number: `expected` at the speed with which the last step goes on, where the force
/// was `last`; each newton more takes from that speed what changes the force by `give` newtons.
pub(super) fn eased(expected: f64, last: f64, give: f64) -> f64 {
    (expected + give * last) / (1.0 + give)
}

/// Running gear of all rail-bound bodies for steps of one length.
#[derive(Clone, Debug, Default)]
pub(crate) struct ImplicitGear {
    dt: f64,
    /// A and (1 − A) C of each rail-bound body, in the frame of the rail.
    gears: Vec<Option<[Matrix6<f64>; 2]>>,
    /// Frames of the rail (t, l, u) at the bodies.
    frames: Vec<Matrix3<f64>>,
}

impl ImplicitGear {
    /// Makes the running gear of a train of `count` bodies.
    pub fn new(count: usize) -> Self {
        Self {
            dt: 0.0,
            gears: vec![None; count],
            frames: vec![Matrix3::identity(); count],
        }
    }

    /// Sets the frame of the rail at body `i` from the tangent there and the sum of the `ups` under its stations.
    pub fn turn(&mut self, i: usize, t: &Vector3<f64>, ups: &Vector3<f64>) {
        let l = ups.cross(t);
        let l = l / l.norm_squared().sqrt();
        self.frames[i] = Matrix3::from_columns(&[*t, l, t.cross(&l)]);
    }

    /// Adds to the wrenches of a step of `dt` (s) the gyroscopic torque, and on rail-bound bodies what makes the step
    /// implicit in their running gear; returns the sum of the forces.
    pub fn hold(
        &mut self,
        train: &Train,
        bodies: &[BodyState],
        gravity: f64,
        dt: f64,
        out: &mut [Wrench],
    ) -> Vector3<f64> {
        if self.dt != dt {
            self.gears = (0..bodies.len()).map(|i| gear(train, i, dt)).collect();
            self.dt = dt;
        }
        let mut sum = Vector3::zeros();
        let each = bodies.iter().zip(&train.bodies).zip(out.iter_mut());
        for (((s, body), wrench), (gear, q)) in each.zip(self.gears.iter().zip(&self.frames)) {
            let w = s.middle_w();
            wrench.torque -= w.cross(&(s.r * (body.inertia * s.r.tr_mul(&w))));
            let Some([by_force, by_change]) = gear else {
                continue;
            };
            let in_rail = |a: &Vector3<f64>, b: &Vector3<f64>| {
                let (a, b) = (q.tr_mul(a), q.tr_mul(b));
                Vector6::new(a.x, a.y, a.z, b.x, b.y, b.z)
            };
            let weight = Vector3::new(0.0, 0.0, -gravity * body.mass_kg);
            let force = in_rail(&(wrench.force + weight), &wrench.torque);
            let more = by_change * in_rail(&s.gained[0], &s.gained[1]) - by_force * force;
            let push = q * more.fixed_rows::<3>(0);
            wrench.force += push;
            wrench.torque += q * more.fixed_rows::<3>(3);
            sum += push;
        }
        sum
    }
}

/// A and (1 − A) C of a rail-bound body.
fn gear(train: &Train, i: usize, dt: f64) -> Option<[Matrix6<f64>; 2]> {
    if train.bodies[i].stations.is_empty() {
        return None;
    }
    let [stiffness, damping] = train.running_gear(i);
    let back = 0.5 * damping + dt / 12.0 * stiffness;
    let inverse = (train.bodies[i].mass_matrix() + dt * back).try_inverse()?;
    let by_force = dt * back * inverse;
    Some([by_force, damping - by_force * damping])
}
