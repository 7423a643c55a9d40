//! Force balance of the train along the rail: terms whose sum is the change of its momentum.
//!
//! ```text
//! M_eff v̇ = drive + clamped rolling + running rolling + guide rolling + bearing + air + brake + grade + curve + contact
//!
//! v     = (Σ mᵢ vᵢ·tᵢ + Σ J ω / r) / M_eff        speed of the momentum: all bodies, and the wheels with their motors
//! M_eff = Σ mᵢ + Σ J / r²
//! ```
//!
//! tᵢ is the direction of the rail at body i: the mean of the tangents under its stations; of a suspended body, the
//! mean of the directions of the bodies that it hangs from. A swinging load is in the momentum, so that no term stands
//! for its swing: the chains pull beam and load alike. All terms are positive forwards.

use nalgebra::Vector3;

/// Terms of the force balance along the rail, N, positive forwards, mean over the last step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct ForceBalance {
    /// Torque of the gears on the friction wheels over their radius, including the part that accelerates wheels and
    /// motors.
    pub drive_n: f64,
    /// Rolling of the clamped friction wheels.
    pub(crate) clamped_rolling_n: f64,
    /// Rolling of the running wheels.
    pub(crate) running_rolling_n: f64,
    /// Rolling of the guide wheels: the resistance of curves.
    pub(crate) guide_rolling_n: f64,
    /// Bearings.
    pub(crate) bearing_n: f64,
    /// Air drag.
    pub(crate) air_n: f64,
    /// Clamp brakes.
    pub(crate) brake_n: f64,
    /// Weight, −Σ mᵢ g tᵢ·z.
    pub(crate) grade_n: f64,
    /// Force of a bend, crest or sag on the momentum along the rail without resistance: wheels of one body that stand
    /// on different tangents, couplings between bodies of different direction, and the momentum that the rail turns, Σ
    /// mᵢ vᵢ·ṫᵢ. Nothing on a straight rail of constant grade.
    pub(crate) curve_n: f64,
    /// Contact with obstacles and with the rail's flanges, while such contact is possible.
    pub contact_n: f64,
    /// M_eff v̇, computed only from the bodies' velocities before and after the step.
    pub inertia_n: f64,
    /// M_eff, kg.
    pub effective_mass_kg: f64,
    /// v, m/s.
    pub speed_mps: f64,
}

impl ForceBalance {
    /// Sum of all forces, N.
    pub fn sum_n(&self) -> f64 {
        self.terms_n().iter().sum()
    }

    /// The forces, N, in the order of the fields.
    pub fn terms_n(&self) -> [f64; 10] {
        [
            self.drive_n,
            self.clamped_rolling_n,
            self.running_rolling_n,
            self.guide_rolling_n,
            self.bearing_n,
            self.air_n,
            self.brake_n,
            self.grade_n,
            self.curve_n,
            self.contact_n,
        ]
    }
}

/// Directions of the rail at the bodies in the last step.
#[derive(Clone, Debug, Default)]
pub(crate) struct Directions {
    now: Vec<Vector3<f64>>,
    /// Supports of each suspended body, beginning with bodies that hang from rail-bound bodies; empty for rail-bound
    /// bodies.
    suspended: Vec<(usize, Vec<usize>)>,
}

impl Directions {
    /// Makes the balance of a train of `count` bodies; `suspended` lists each suspended body with the bodies on which
    /// it hangs.
    pub fn new(count: usize, suspended: Vec<(usize, Vec<usize>)>) -> Self {
        Self {
            now: vec![Vector3::zeros(); count],
            suspended,
        }
    }

    /// Set the direction of a rail-bound body from the sum of the tangents under its stations.
    pub fn set(&mut self, body: usize, tangents: &Vector3<f64>) {
        self.now[body] = unit(tangents);
    }

    /// Sets the directions of the suspended bodies from the directions of the rail-bound bodies.
    pub fn complete(&mut self) {
        for (body, above) in &self.suspended {
            let sum: Vector3<f64> = above.iter().map(|i| self.now[*i]).sum();
            self.now[*body] = unit(&sum);
        }
    }

    /// Direction of each body, unit vectors in the world.
    pub fn now(&self) -> &[Vector3<f64>] {
        &self.now
    }
}

fn unit(v: &Vector3<f64>) -> Vector3<f64> {
    let n = v.norm_squared().sqrt();
    if n > 0.0 { v / n } else { Vector3::zeros() }
}
