//! Motion of a rigid body that touches nothing: the arithmetic of rapier's step without its pipeline.
//!
//! ```text
//! v⁺ = v + (F/m + g) dt                          symplectic Euler: the pose moves with the velocities of the end
//! L  = J Rᵀω + Rᵀτ dt,   ω' = J⁻¹ L              body frame
//! L⁺ = (L − ω' × L dt) |L| / |L − ω' × L dt|     gyroscopic term, with the length of the angular momentum kept
//! ω⁺ = R J⁻¹ L⁺
//! q⁺ = (1, ½ ω⁺ dt) q, normalised
//! ```
//!
//! rapier 0.36, `staged_island_solver/worker.rs` with one substep and no constraint. Equal to it but for rounding; the
//! pipeline spends more than half of its time on islands, joints and contacts that a train away from obstacles does not
//! have.

use crate::plant::train::body_state::{BodyState, Wrench};
use crate::train::Body;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// The properties on which a body's motion depends.
#[derive(Clone, Copy, Debug)]
pub struct FreeBody {
    inverse_mass: f64,
    /// Centre of mass in the body frame, m.
    com: Vector3<f64>,
    /// Inertia about the centre of mass in the body frame, kg·m², and its inverse.
    inertia: Matrix3<f64>,
    inverse_inertia: Matrix3<f64>,
}

impl FreeBody {
    /// Makes a body with the mass, centre of mass and inertia of `b`. A body without inertia does not turn.
    pub fn new(b: &Body) -> Self {
        Self {
            inverse_mass: 1.0 / b.mass_kg,
            com: b.com,
            inertia: b.inertia,
            inverse_inertia: b.inertia.try_inverse().unwrap_or_else(Matrix3::zeros),
        }
    }

    /// Advance a body by `dt` (s) under a wrench and gravity (m/s², downwards).
    #[inline]
    pub fn step(&self, s: &mut BodyState, wrench: &Wrench, gravity: f64, dt: f64) {
        s.v += wrench.force * (self.inverse_mass * dt);
        s.v.z -= gravity * dt;

        let momentum = self.inertia * s.r.tr_mul(&s.w) + s.r.tr_mul(&wrench.torque) * dt;
        let w = self.inverse_inertia * momentum;
        let turned = momentum - w.cross(&momentum) * dt;
        let length = turned.norm_squared();
        s.w = if length > 0.0 {
            let kept = (momentum.norm_squared() / length).sqrt();
            s.r * (self.inverse_inertia * (turned * kept))
        } else {
            s.r * w
        };

        s.c += s.v * dt;
        let half = s.w * (0.5 * dt);
        let q = Quaternion::new(1.0, half.x, half.y, half.z) * s.q.into_inner();
        s.q = UnitQuaternion::new_unchecked(q / q.norm_squared().sqrt());
        s.r = s.q.to_rotation_matrix().into_inner();
        s.p = s.c - s.r * self.com;
    }
}
