//! Bristle friction between a clamped wheel (or brake shoe) and the rail's web.
//!
//! LuGre friction with a rolling term and elasto-plastic pre-sliding, per contact:
//!
//! ```text
//! v_r = ω r − v_t                                             slip speed, m/s
//! ż   = v_r − α(z, v_r) (σ0 |v_r| / g) z − κ |ω r| z           bristle deflection, m
//! F   = σ0 z + σ1 ż,   |F| ≤ g,   g = µ N                     force on the rail-bound body, N
//! ```
//!
//! Sources: Canudas de Wit et al. 1995 (LuGre); Deur, Asgari, Hrovat 2004 (rolling term κ); Dupont et al. 2002, eq. 14
//! (α, which is 0 below the break-away deflection, so that a parked train does not creep).
//!
//! σ0 is stiff, so z and ω are solved together, implicitly, in closed form.

/// Below this share of the largest deflection the bristles are purely elastic.
const BREAK_AWAY_SHARE: f64 = 0.7;

/// Parameters of a contact.
#[derive(Clone, Copy, Debug)]
pub struct Bristle {
    /// Bristle stiffness, N/m.
    pub sigma0: f64,
    /// Bristle damping, N·s/m.
    pub sigma1: f64,
    /// Rolling term, 1/m.
    pub kappa: f64,
}

/// Parameters of a friction wheel.
#[derive(Clone, Copy, Debug)]
pub struct WheelParameters {
    /// Contact of the wheel.
    pub bristle: Bristle,
    /// Inertia about its axle, with its share of the motor, kg·m².
    pub inertia: f64,
    /// Radius, m.
    pub radius: f64,
}

/// A turning wheel on the rail.
#[derive(Clone, Copy, Debug, Default)]
pub struct RollingContact {
    /// Bristle deflection, m.
    pub z: f64,
    /// Wheel rate, rad/s.
    pub omega: f64,
    /// Force on the train along the rail, N, of the last step.
    pub force: f64,
    /// Power lost in the contact, W, of the last step.
    pub loss: f64,
    /// Share of sliding in the contact, 0 (holds) … 1 (slides), of the last step.
    pub sliding_share: f64,
}

impl Bristle {
    /// Elasto-plastic transition α(z, v): 0 elastic … 1 sliding.
    fn alpha(&self, z: f64, v: f64, z_max: f64) -> f64 {
        let (a, z_ba) = (z.abs(), BREAK_AWAY_SHARE * z_max);
        if z * v <= 0.0 || a <= z_ba {
            0.0
        } else if a >= z_max {
            1.0
        } else {
            let x = (a - z_ba) / (z_max - z_ba);
            x * x * (3.0 - 2.0 * x)
        }
    }
}

impl RollingContact {
    /// Advance by `dt`: limit force `g` (N), torque on the wheel `torque` (N·m), rail-bound body moving at `v_t` (m/s).
    /// Sets and returns the force on the body, N.
    pub fn step(&mut self, wheel: &WheelParameters, g: f64, torque: f64, v_t: f64, dt: f64) -> f64 {
        let (b, j, r) = (&wheel.bristle, wheel.inertia, wheel.radius);
        if g <= 0.0 {
            self.z = 0.0;
            self.omega += dt / j * torque;
            self.loss = 0.0;
            self.force = 0.0;
            self.sliding_share = 1.0;
            return 0.0;
        }
        let z_max = g / b.sigma0;
        let v_r = self.omega * r - v_t;
        self.sliding_share = b.alpha(self.z, v_r, z_max);
        let a =
            1.0 + dt * (self.sliding_share * v_r.abs() / z_max + b.kappa * (self.omega * r).abs());
        let gain = (b.sigma0 + b.sigma1 / dt) / a;
        let mut omega = (self.omega
            + dt / j * (torque - r * (gain * (self.z - dt * v_t) - b.sigma1 / dt * self.z)))
            / (1.0 + dt * dt * r * r * gain / j);
        let mut z = (self.z + dt * (omega * r - v_t)) / a;
        let mut force = b.sigma0 * z + b.sigma1 * (z - self.z) / dt;
        if force.abs() > g {
            self.sliding_share = 1.0;
            force = g.copysign(force);
            omega = self.omega + dt / j * (torque - r * force);
            z = z.clamp(-z_max, z_max);
        }
        let stored = 0.5 * b.sigma0 * (z * z - self.z * self.z) / dt;
        self.loss = force * (omega * r - v_t) - stored;
        self.z = z;
        self.omega = omega;
        self.force = force;
        force
    }
}

/// A brake shoe: a contact that does not turn.
#[derive(Clone, Copy, Debug, Default)]
pub struct SlidingContact {
    /// Bristle deflection, m.
    pub z: f64,
    /// Force on the train along the rail, N, of the last step.
    pub force: f64,
    /// Power lost in the contact, W, of the last step.
    pub loss: f64,
}

impl SlidingContact {
    /// Advance by `dt` with limit force `g` (N) on a body moving at `v_t` (m/s). Sets and returns the force on it, N.
    pub fn step(&mut self, b: &Bristle, g: f64, v_t: f64, dt: f64) -> f64 {
        if g <= 0.0 {
            *self = Self::default();
            return 0.0;
        }
        let z_max = g / b.sigma0;
        let v_r = -v_t;
        if self.z * v_r > 0.0 && self.z.abs() >= z_max {
            // Slides on at its limit: what the equations below come to.
            self.z = z_max.copysign(v_r);
            self.force = g.copysign(v_r);
            self.loss = g * v_r.abs();
            return self.force;
        }
        self.z = self.z.clamp(-z_max, z_max);
        let a = 1.0 + dt * b.alpha(self.z, v_r, z_max) * v_r.abs() / z_max;
        let z = ((self.z + dt * v_r) / a).clamp(-z_max, z_max);
        let force = (b.sigma0 * z + b.sigma1 * (z - self.z) / dt).clamp(-g, g);
        self.loss = force * v_r - 0.5 * b.sigma0 * (z * z - self.z * self.z) / dt;
        self.z = z;
        self.force = force;
        force
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const B: Bristle = Bristle {
        sigma0: 1.2e7,
        sigma1: 2e4,
        kappa: 20.0,
    };

    const WHEEL: WheelParameters = WheelParameters {
        bristle: B,
        inertia: 2.0,
        radius: 0.17,
    };

    #[test]
    fn a_sliding_contact_carries_exactly_its_limit() {
        let mut c = SlidingContact::default();
        for _ in 0..200 {
            c.step(&B, 5000.0, 1.0, 2e-3);
        }
        assert!((c.force + 5000.0).abs() < 1e-6, "{}", c.force);
        assert!(
            (c.loss - 5000.0).abs() < 1.0,
            "sliding at 1 m/s under 5 kN loses 5 kW, not {}",
            c.loss
        );
    }

    #[test]
    fn a_held_load_below_break_away_does_not_creep() {
        // A mass on the contact, pushed with half the limit and shaken: after the shake it stands where it stood
        // before.
        let (m, dt) = (1000.0, 1e-3);
        let mut c = SlidingContact::default();
        let (mut x, mut v) = (0.0, 0.0);
        let mut settled = 0.0;
        for k in 0..60_000 {
            let shake = if (10_000..50_000).contains(&k) {
                500.0 * libm::sin(0.05 * k as f64)
            } else {
                0.0
            };
            v += dt / m * (2500.0 + shake + c.step(&B, 5000.0, v, dt));
            x += dt * v;
            if k == 9_999 {
                settled = x;
            }
        }
        assert!((x - settled).abs() < 1e-9, "crept {} m", x - settled);
    }

    #[test]
    fn rolling_creep_is_kappa_times_force_over_stiffness() {
        // Steady rolling: v_r = κ |ωr| z and F = σ0 z, so v_r / (ω r) = κ F / σ0.
        let mut c = RollingContact {
            omega: 1.0 / 0.17,
            ..Default::default()
        };
        for _ in 0..20_000 {
            c.step(&WHEEL, 10_000.0, 3000.0 * 0.17, 1.0, 1e-3);
        }
        let creep = (c.omega * 0.17 - 1.0) / (c.omega * 0.17);
        assert!((c.force - 3000.0).abs() < 1e-3);
        assert!(
            (creep / (20.0 * 3000.0 / 1.2e7) - 1.0).abs() < 1e-3,
            "creep {creep}"
        );
    }

    #[test]
    fn torque_beyond_adhesion_spins_the_wheel_and_the_force_stays_at_its_limit() {
        let mut c = RollingContact::default();
        for _ in 0..1000 {
            c.step(&WHEEL, 4000.0, 2.0 * 4000.0 * 0.17, 0.0, 1e-3);
        }
        // On the spot v_r = ω r: the rolling term takes a share κ g/σ0 (0.7 %) off µN, and nothing takes more.
        assert!(c.force <= 4000.0 && c.force > 0.993 * 4000.0, "{}", c.force);
        // J ω̇ = T − r F → after 1 s ω = (2 · 4000 − F) r / J.
        let omega = (2.0 * 4000.0 - c.force) * 0.17 / 2.0;
        assert!((c.omega / omega - 1.0).abs() < 0.01, "{}", c.omega);
    }
}
