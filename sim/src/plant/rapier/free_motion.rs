//! Motion of a rigid body that touches nothing: the arithmetic of rapier's step without its pipeline.
//!
//! ```text
//! q½ = (1 + √(1 + h²), h) q, normalised, h = ½ ω dt, c½ = c + ½ v dt      half of rapier's step, twice
//! v⁺ = v + (F/m + g) dt,   ω⁺ = ω + R½ J⁻¹ R½ᵀ τ dt                       between the two
//! ```
//!
//! rapier 0.36, `staged_island_solver/worker.rs` with one substep and no constraint, moves a body by a whole step after
//! its velocity has changed: it gets the bodies in the middle of a step, and gives them back in the middle of the next.
//! Equal to it but for rounding; the pipeline spends more than half of its time on islands, joints and contacts that a
//! train away from obstacles does not have. The gyroscopic torque is in τ.

use crate::plant::train::body_state::{BodyState, Wrench};
use crate::train::Body;
use crate::train::springs::SPRING_SHARE;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// The properties on which a body's motion depends.
#[derive(Clone, Copy, Debug)]
pub struct FreeBody {
    inverse_mass: f64,
    /// Centre of mass in the body frame, m.
    com: Vector3<f64>,
    /// Inverse of the inertia about the centre of mass in the body frame, 1/(kg·m²).
    inverse_inertia: Matrix3<f64>,
}

impl FreeBody {
    /// Makes a body with the mass, centre of mass and inertia of `b`. A body without inertia does not turn.
    pub fn new(b: &Body) -> Self {
        Self {
            inverse_mass: 1.0 / b.mass_kg,
            com: b.com,
            inverse_inertia: b.inertia.try_inverse().unwrap_or_else(Matrix3::zeros),
        }
    }

    /// Takes a body from the beginning of a step of `dt` (s) to its middle, as if its velocities changed as in the last
    /// step.
    pub fn reach_middle(&self, s: &mut BodyState, dt: f64) {
        let ahead = s.with(0.0);
        self.drift(s, ahead, 0.5 * dt, dt);
        [s.v, s.w] = s.with(0.5);
    }

    /// Changes the velocities over `dt` (s) under a wrench and gravity (m/s², downwards).
    pub fn push(&self, s: &mut BodyState, wrench: &Wrench, gravity: f64, dt: f64) {
        s.v += wrench.force * (self.inverse_mass * dt);
        s.v.z -= gravity * dt;
        s.w += s.r * (self.inverse_inertia * (s.r.tr_mul(&wrench.torque) * dt));
    }

    /// Takes a body with the velocities of the end of a step of `dt` (s) from the middle to the end, or there from the
    /// middle of the next step, and sets what its velocities have gained since those `before`.
    pub fn reach_end(
        &self,
        s: &mut BodyState,
        before: &[Vector3<f64>; 2],
        dt: f64,
        from_next: bool,
    ) {
        let way = if from_next { -0.5 * dt } else { 0.5 * dt };
        self.drift(s, [s.v, s.w], way, -dt);
        s.gained = [s.v - before[0], s.w - before[1]];
    }

    /// Moves a body for a time `way` (s) at two velocities, and by what the last step's change asks for in `dt` (s).
    fn drift(&self, s: &mut BodyState, [v, w]: [Vector3<f64>; 2], way: f64, dt: f64) {
        s.c += v * way + s.gained[0] * (SPRING_SHARE * dt);
        let h = w * way + s.gained[1] * (SPRING_SHARE * dt);
        let real = 1.0 + (1.0 + h.norm_squared()).sqrt();
        let q = Quaternion::new(real, h.x, h.y, h.z) * s.q.into_inner();
        s.q = UnitQuaternion::new_unchecked(q * (1.0 / q.norm_squared().sqrt()));
        s.r = s.q.to_rotation_matrix().into_inner();
        s.p = s.c - s.r * self.com;
    }
}
