//! The body leans on its springs, which moves load between the wheels.
//!
//! At rest each axle carries its share of the weight. A specific force f (along or to the left, m/s²) at the centre of
//! gravity, h above the road, shifts m h f over the wheelbase or the track width. Springs and dampers carry that
//! moment, so it comes with their dynamics: q is the specific force as the springs have taken it up,
//!
//! ```text
//! q̈ + 2 ζ ω q̇ + ω² q = ω² f        moment = m h (q + 2 ζ q̇ / ω)        lean = gradient · q
//! ```
//!
//! The lean is what makes an accelerometer on the body read more than the road's grade. It takes no energy from the
//! motion (some joules in a car of two tonnes at 10 m/s).

/// One direction of lean: pitch or roll.
#[derive(Clone, Copy, Debug, Default)]
pub struct LeanState {
    /// Specific force carried by the springs, m/s².
    pub q: f64,
    /// Rate of change of this specific force, m/s³.
    pub rate: f64,
}

/// Springs and dampers of the body.
#[derive(Clone, Copy, Debug)]
pub struct Suspension {
    /// Undamped natural frequency, rad/s.
    pub omega: f64,
    /// Damping ratio.
    pub zeta: f64,
    /// Pitch per specific force, rad per m/s².
    pub pitch_gradient: f64,
    /// Roll per specific force, rad per m/s².
    pub roll_gradient: f64,
    /// Share of the roll moment that the front axle carries.
    pub front_roll_share: f64,
}

impl LeanState {
    /// Makes springs in balance with a specific force, m/s².
    pub fn settled(force: f64) -> Self {
        Self {
            q: force,
            rate: 0.0,
        }
    }

    /// Advance by `dt` (s) under a specific force, m/s².
    pub fn step(&mut self, s: &Suspension, force: f64, dt: f64) {
        self.rate +=
            dt * (s.omega * s.omega * (force - self.q) - 2.0 * s.zeta * s.omega * self.rate);
        self.q += dt * self.rate;
    }

    /// Specific force that springs and dampers carry, m/s².
    pub fn carried(&self, s: &Suspension) -> f64 {
        self.q + 2.0 * s.zeta / s.omega * self.rate
    }
}

/// Geometry and mass on which the load transfer depends.
#[derive(Clone, Copy, Debug)]
pub struct ChassisGeometry {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Distance from the centre of gravity to the front axle, m.
    pub front_m: f64,
    /// Distance from the centre of gravity to the rear axle, m.
    pub rear_m: f64,
    /// Distance of left and right wheels, m.
    pub track_width_m: f64,
    /// Height of the centre of gravity over the road, m.
    pub height_m: f64,
}

impl ChassisGeometry {
    /// Distance of the axles, m.
    pub fn wheelbase_m(&self) -> f64 {
        self.front_m + self.rear_m
    }

    /// Loads of the wheels, N, in the order front left, front right, rear left, rear right; `normal` (N) is their sum.
    /// A wheel that lifts carries nothing.
    pub fn loads(
        &self,
        s: &Suspension,
        normal: f64,
        pitch: &LeanState,
        roll: &LeanState,
    ) -> [f64; 4] {
        let moment = self.mass_kg * self.height_m;
        let back = moment * pitch.carried(s) / self.wheelbase_m();
        let right = moment * roll.carried(s) / self.track_width_m;
        let front_axle = normal * self.rear_m / self.wheelbase_m() - back;
        let rear_axle = normal * self.front_m / self.wheelbase_m() + back;
        let (front, rear) = (
            s.front_roll_share * right,
            (1.0 - s.front_roll_share) * right,
        );
        [
            0.5 * front_axle - front,
            0.5 * front_axle + front,
            0.5 * rear_axle - rear,
            0.5 * rear_axle + rear,
        ]
        .map(|n| n.max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPRINGS: Suspension = Suspension {
        omega: 9.0,
        zeta: 0.35,
        pitch_gradient: 0.002,
        roll_gradient: 0.007,
        front_roll_share: 0.55,
    };
    const CAR: ChassisGeometry = ChassisGeometry {
        mass_kg: 2000.0,
        front_m: 1.2,
        rear_m: 1.5,
        track_width_m: 1.6,
        height_m: 0.6,
    };

    #[test]
    fn lean_settles_at_the_specific_force() {
        let mut lean = LeanState::default();
        for _ in 0..20_000 {
            lean.step(&SPRINGS, 1.7, 5e-4);
        }
        assert!((lean.q - 1.7).abs() < 1e-9 && lean.rate.abs() < 1e-9);
    }

    /// Moments about the rear contacts and about the middle of the track, by hand.
    #[test]
    fn settled_loads_balance_force_and_moments() {
        let normal = 2000.0 * 9.81;
        let (fx, fy) = (2.0, 3.0);
        let l = CAR.loads(
            &SPRINGS,
            normal,
            &LeanState::settled(fx),
            &LeanState::settled(fy),
        );
        assert!((l.iter().sum::<f64>() - normal).abs() < 1e-9);
        let front = l[0] + l[1];
        assert!((front * 2.7 - (normal * 1.5 - 2000.0 * fx * 0.6)).abs() < 1e-8);
        let right_minus_left = l[1] + l[3] - l[0] - l[2];
        assert!((right_minus_left * 0.8 - 2000.0 * fy * 0.6).abs() < 1e-8);
    }
}
