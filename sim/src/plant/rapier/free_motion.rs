//! Motion of a rigid body that touches nothing: the arithmetic of rapier's step without its pipeline.
//!
//! ```text
//! q½ = (1 + √(1 + h²), h) q, normalised, h = ½ ω dt, c½ = c + ½ v dt      half of rapier's step, twice
//! v⁺ = v + (F/m + g) dt,   ω⁺ = ω + R½ J⁻¹ R½ᵀ τ dt                       between the two
//! ```
//!
//! rapier 0.36, `staged_island_solver/worker.rs` with one substep and no constraint, moves a body by a whole step after its
//! velocity has changed: it gets the bodies in the middle of a step, and gives them back in the middle of the next. Equal
//! to it but for rounding; the pipeline spends more than half of its time on islands, joints and contacts that a train
//! away from obstacles does not have. The gyroscopic torque is in τ.

use crate::plant::train::body_state::{BodyState, Wrench};
use crate::train::Body;
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

    /// Changes the velocities over `dt` (s) under a wrench and gravity (m/s², downwards).
    pub fn push(&self, s: &mut BodyState, wrench: &Wrench, gravity: f64, dt: f64) {
        s.v += wrench.force * (self.inverse_mass * dt);
        s.v.z -= gravity * dt;
        s.w += s.r * (self.inverse_inertia * (s.r.tr_mul(&wrench.torque) * dt));
    }

    /// Moves a body by half of a step of `dt` (s) with its velocities; back if `dt` is negative.
    pub fn drift(&self, s: &mut BodyState, dt: f64) {
        s.c += s.v * (0.5 * dt);
        let h = s.w * (0.5 * dt);
        let real = 1.0 + (1.0 + h.norm_squared()).sqrt();
        let q = Quaternion::new(real, h.x, h.y, h.z) * s.q.into_inner();
        s.q = UnitQuaternion::new_unchecked(q / q.norm_squared().sqrt());
        s.r = s.q.to_rotation_matrix().into_inner();
        s.p = s.c - s.r * self.com;
    }
}
