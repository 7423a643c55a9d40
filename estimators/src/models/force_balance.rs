//! Longitudinal force balance of a monorail crane or a road vehicle (Liu et al. 2023, eq. 1–7; Guo et al. 2024, eq. 1):
//!
//! (M + J) v̇ = F − M g sin θ − sgn(v) μ M g cos θ − ½ ρ C_D A v |v|
//!
//! The last term, air drag, is there on a road only: at a crane's 2 m/s it is a few newtons.
//!
//! F traction at the rims, N; M total mass, kg; J rotating masses reflected to the rim, Σ J/r², kg; μ running
//! resistance. The paper prints the inertia factor as 1 + 4 J g/(R² M); with J in kg·m², the unit its table 3 gives,
//! that g is stray: it would make the rotating masses ten times what they are. Eq. 2 (T = F r) lacks gear, efficiency
//! and the number of drive units.
//!
//! With the specific force f = v̇ + g sin θ that an accelerometer reads, the balance loses its slope but for a cosine:
//! F − J v̇ = M f + sgn(v) μ M g cos θ.

use crate::Real;
use crate::api::real::{GRAVITY, PI, sin_cos, sqrt};
use crate::api::signals::Vehicle;

/// Largest grade angle of an estimate, rad: no monorail climbs more.
pub(crate) const MAX_GRADE_RAD: Real = PI / 3.0;

/// Input of a prediction by the force balance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// Traction at the rims, N.
    pub traction_n: Real,
    /// Total mass, kg.
    pub mass_kg: Real,
    /// Running resistance with the sign of the speed: sgn(v) μ.
    pub resistance: Real,
}

/// The constants of the balance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceBalance {
    rim_per_motor: Real,
    efficiency: Real,
    /// ½ ρ C_D A, N per (m/s)²; 0 on a rail.
    drag_npm2s2: Real,
    /// Rotating masses reflected to the rim, kg.
    pub rotating_mass_kg: Real,
}

impl ForceBalance {
    /// Builds the force balance from the vehicle's nominal values.
    pub fn new(vehicle: &Vehicle) -> Self {
        Self {
            rim_per_motor: vehicle.gear_ratio / vehicle.wheel_radius_m,
            efficiency: vehicle.efficiency,
            drag_npm2s2: vehicle
                .road
                .map_or(0.0, |road| 0.5 * road.air_density_kgpm3 * road.drag_area_m2),
            rotating_mass_kg: vehicle.rotating_mass_kg,
        }
    }

    /// Traction at the rims, N, from the sum of all motor torques, N·m: F = T i η / r while the motors drive, T i / (η
    /// r) while the train drives them.
    pub fn traction(&self, motor_torque_nm: Real, speed_mps: Real) -> Real {
        let efficiency = if motor_torque_nm * speed_mps >= 0.0 {
            self.efficiency
        } else {
            1.0 / self.efficiency
        };
        motor_torque_nm * self.rim_per_motor * efficiency
    }

    /// Traction at the wheel rims minus air drag, N: what is left for weight, running resistance and acceleration.
    pub(crate) fn net_traction(&self, motor_torque_nm: Real, speed_mps: Real) -> Real {
        self.traction(motor_torque_nm, speed_mps) - self.drag(speed_mps)
    }

    /// Drag of the air, N, with the sign of the speed; 0 on a rail.
    pub(crate) fn drag(&self, speed_mps: Real) -> Real {
        self.drag_npm2s2 * speed_mps * speed_mps.abs()
    }

    /// Acceleration v̇, m/s², under a net traction, and ∂v̇/∂θ, m/s² per rad. `resistance` is sgn(v) μ.
    pub(crate) fn acceleration(
        &self,
        traction_n: Real,
        mass_kg: Real,
        theta: Real,
        resistance: Real,
    ) -> [Real; 2] {
        let (weight, inertia) = (mass_kg * GRAVITY, mass_kg + self.rotating_mass_kg);
        let [sine, cosine] = sin_cos(theta);
        [
            (traction_n - weight * (sine + resistance * cosine)) / inertia,
            -weight * (cosine - resistance * sine) / inertia,
        ]
    }

    /// cos θ from accelerometer and wheels, sin θ = (f − v̇)/g: exact enough for a cosine, and no loop through a
    /// filter.
    pub(crate) fn cosine(specific_force_mps2: Real, acceleration_mps2: Real) -> Real {
        let sine = ((specific_force_mps2 - acceleration_mps2) / GRAVITY).clamp(-0.7, 0.7);
        sqrt(1.0 - sine * sine)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::vehicles::{car, vehicle};

    #[test]
    fn the_balance_balances() {
        let balance = ForceBalance::new(&vehicle());
        let (mass, theta, mu): (Real, Real, Real) = (15_000.0, 0.1, 0.02);
        let hold = mass * GRAVITY * (theta.sin() + mu * theta.cos());
        let at = |traction| balance.acceleration(traction, mass, theta, mu)[0];
        assert!(at(hold).abs() < 1e-12);
        let surplus = at(hold + 1600.0) * (mass + balance.rotating_mass_kg);
        assert!((surplus - 1600.0).abs() < 1e-9);
        // F − J v̇ = M f + μ M g cos θ
        let a = at(2e4);
        let f = a + GRAVITY * theta.sin();
        assert!(
            (2e4 - balance.rotating_mass_kg * a
                - mass * (f + mu * GRAVITY * ForceBalance::cosine(f, a)))
            .abs()
                < 1e-8
        );
    }

    #[test]
    fn jacobian_equals_central_difference() {
        let balance = ForceBalance::new(&vehicle());
        for theta in [-0.5, -0.1, 0.0, 0.2, 0.5] {
            let at = |theta| balance.acceleration(3e4, 2e4, theta, -0.03);
            let [[high, _], [_, by_theta], [low, _]] = [theta + 1e-6, theta, theta - 1e-6].map(at);
            assert!(((high - low) / 2e-6 - by_theta).abs() < 1e-7);
        }
    }

    #[test]
    fn air_drags_on_a_road_vehicle_and_not_on_a_train() {
        let train = ForceBalance::new(&vehicle());
        assert_eq!(train.net_traction(300.0, 2.0), train.traction(300.0, 2.0));
        // ½ · 1.2258 · 0.332 · 2.574 · 10² N, against the motion either way.
        let car = ForceBalance::new(&car());
        let drag = |v| car.traction(100.0, v) - car.net_traction(100.0, v);
        assert!((drag(10.0) - 52.376).abs() < 1e-3);
        assert_eq!(drag(-10.0), -drag(10.0));
    }

    #[test]
    fn power_is_lost_in_the_gear_both_ways() {
        let balance = ForceBalance::new(&vehicle());
        let (torque, speed) = (300.0, 1.0);
        let motor_power = |v: Real, t: Real| t * balance.rim_per_motor * v;
        assert!(balance.traction(torque, speed) * speed < motor_power(speed, torque));
        assert!(balance.traction(-torque, speed) * speed < motor_power(speed, -torque));
    }

    #[test]
    fn traction_is_torque_times_gear_over_radius_and_the_losses_of_its_direction() {
        let balance = ForceBalance::new(&vehicle());
        let plain = 300.0 * 20.0 / 0.17;
        for (torque, speed, efficiency) in [
            (1.0, 1.0, 0.9),
            (1.0, -1.0, 1.0 / 0.9),
            (-1.0, 1.0, 1.0 / 0.9),
            (-1.0, -1.0, 0.9),
            (1.0, 0.0, 0.9),
            (-1.0, 0.0, 0.9),
        ] {
            let traction = balance.traction(300.0 * torque, speed);
            assert!((traction - torque * plain * efficiency).abs() < 1e-6);
        }
    }
}
