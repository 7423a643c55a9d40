//! Momentum of the train along the rail, and the force balance of a step.

use super::World;
use crate::plant::train::balance::ForceBalance;

/// Momentum along the rail before a step, kg·m/s.
pub(super) struct Momentum {
    bodies: f64,
    rotating: f64,
}

impl World {
    /// Momentum now, with the directions of the rail of the last step.
    pub(super) fn momentum(&self) -> Momentum {
        Momentum {
            bodies: self.bodies_momentum(0.0),
            rotating: self.dynamics.rotating_momentum().0,
        }
    }

    /// Σ mᵢ vᵢ·tᵢ, kg·m/s, with a share of the last change of the velocities.
    pub(super) fn bodies_momentum(&self, share: f64) -> f64 {
        let bodies = self.dynamics.train.bodies.iter().zip(self.bodies.states());
        bodies
            .zip(self.dynamics.directions().now())
            .map(|((b, s), t)| b.mass_kg * s.with(share)[0].dot(t))
            .sum()
    }

    /// Computes the force balance of a step of `dt` (s) from the momentum `before` the step, the momentum `turned` into
    /// the directions of this step with the velocities before it, and the present velocities.
    pub(super) fn update_balance(&mut self, before: &Momentum, turned: f64, dt: f64) {
        let (rotating, rotating_mass) = self.dynamics.rotating_momentum();
        let bodies = self.bodies_momentum(0.0);
        let mass = self.dynamics.train.total_mass_kg() + rotating_mass;
        let sums = &self.sums;
        // Contact is what the solver adds to the forces given to it.
        let contact = if self.bodies.contact_possible() {
            (bodies - turned) / dt - sums.along_n - sums.balance.grade_n
        } else {
            0.0
        };
        let after = bodies + rotating;
        self.balance = ForceBalance {
            curve_n: sums.balance.curve_n + (turned - before.bodies) / dt,
            contact_n: contact,
            inertia_n: (after - before.bodies - before.rotating) / dt,
            effective_mass_kg: mass,
            speed_mps: after / mass,
            ..sums.balance
        };
    }
}
