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
//! A step is of second order: the wheel's rate and its deflection are solved together in the middle of the step, in closed
//! form; the body's way up to there is known (see `body_state.rs`), and its speed there, on which σ1 acts, is that of the
//! last step continued and changed by what the contact's own force has changed.

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

/// Motion of a body at a contact over a step.
#[derive(Clone, Copy, Debug)]
pub struct Under {
    /// Speed along the rail before the step, and in its middle if it goes on as in the last step, m/s.
    pub v: [f64; 2],
    /// What each newton of the contact that was not there in the last step adds to the second, m/s.
    pub give: f64,
}

/// Speed of a rim over a step, m/s; all 0 for a shoe, which does not turn.
#[derive(Clone, Copy, Debug, Default)]
struct Rim {
    /// In the middle of the step, if the rate goes on as in the last step.
    expected: f64,
    /// In the middle of the step without the force of the contact.
    free: f64,
    /// What each newton of the contact takes from it, m/s.
    give: f64,
}

/// Bristles between a body and the rail: a brake shoe, the wheels of a station, or a friction wheel's rim.
#[derive(Clone, Copy, Debug, Default)]
pub struct Contact {
    /// Deflection, m, at the end of the last step.
    pub z: f64,
    /// Force on the train along the rail, N, mean over the last step.
    pub force: f64,
    /// Power lost in the contact, W, mean over the last step.
    pub loss: f64,
    /// Slip speed, m/s, mean over the last step.
    pub slip: f64,
    /// Speed that the body should have had at the end of the last step, m/s, and the deflection for each m/s that it was
    /// faster, s.
    expected: f64,
    due: f64,
}

impl Contact {
    /// The contact with another deflection, m, as if the body had gone on evenly.
    pub fn at(self, z: f64) -> Self {
        Self {
            z,
            due: 0.0,
            ..self
        }
    }

    /// Advance by `dt` with limit force `g` (N) under a body. Sets and returns the force on it, N.
    pub fn step(&mut self, b: &Bristle, g: f64, under: &Under, dt: f64) -> f64 {
        self.follow(under);
        let v_r = -under.v[1];
        if g > 0.0 && self.z * v_r > 0.0 && self.z.abs() * b.sigma0 >= g {
            // Slides on at its limit: what the equations come to.
            self.z = (g / b.sigma0).copysign(v_r);
            self.force = g.copysign(v_r);
            (self.loss, self.slip) = (g * v_r.abs(), v_r);
            return self.force;
        }
        self.turn(b, g, under, &Rim::default(), dt)
    }

    /// Corrects the deflection by the speed that the body has reached.
    fn follow(&mut self, Under { v, .. }: &Under) {
        self.z -= self.due * (v[0] - self.expected);
        self.expected = 2.0 * v[1] - v[0];
        self.due = 0.0;
    }

    /// The step of a contact with a rim.
    fn turn(&mut self, b: &Bristle, g: f64, under: &Under, rim: &Rim, dt: f64) -> f64 {
        let v = under.v;
        if g <= 0.0 {
            (self.z, self.force, self.loss, self.slip) = (0.0, 0.0, 0.0, rim.free - v[1]);
            return 0.0;
        }
        let z_max = g / b.sigma0;
        let before = self.z.clamp(-z_max, z_max);
        let v_r = rim.expected - v[1];
        let rate = |z| b.alpha(z, v_r, z_max) * v_r.abs() / z_max + b.kappa * rim.expected.abs();
        let middle = before + 0.5 * dt * (v_r - rate(before) * before);
        let [left, mean, way] = decay(dt * rate(middle));
        let spring = b.sigma0 * way * dt;
        let damper = b.sigma1 * mean;
        let held = (b.sigma0 * mean - b.sigma1 * (1.0 - left) / dt) * before;
        let gain = spring + damper;
        let yields = damper * under.give;
        let pull = held + gain * rim.free - spring * v[0] - damper * v[1] + yields * self.force;
        self.force = (pull / (1.0 + gain * rim.give + yields)).clamp(-g, g);
        self.slip = rim.free - rim.give * self.force - v[1];
        let z = left * before + mean * dt * self.slip;
        self.z = z.clamp(-z_max, z_max);
        if self.z == z {
            self.due = 0.5 * mean * dt;
        }
        let stored = 0.5 * b.sigma0 * (self.z * self.z - before * before) / dt;
        self.loss = self.force * self.slip - stored;
        self.force
    }
}

/// Shares of a value that decays with e⁻ʰ in a step: what is left of it, its mean, and the mean of what comes in evenly.
/// The rational form 1/(1 + h + h²/2) is of second order, and 0 for a decay that is faster than any step.
fn decay(h: f64) -> [f64; 3] {
    let left = 1.0 / (1.0 + h + 0.5 * h * h);
    [left, (1.0 + 0.5 * h) * left, 0.5 * (1.0 + h) * left]
}

/// A turning wheel on the rail.
#[derive(Clone, Copy, Debug, Default)]
pub struct RollingContact {
    /// Where the wheel touches the rail.
    pub contact: Contact,
    /// Wheel rate, rad/s.
    pub omega: f64,
    /// Half the change of the rate in the last step, rad/s.
    pub gained: f64,
}

impl RollingContact {
    /// Rate in the middle of the next step if it goes on as in the last one, rad/s.
    pub fn expected(&self) -> f64 {
        self.omega + self.gained
    }

    /// Advance by `dt`: limit force `g` (N), torque on the wheel `torque` (N·m). Sets and returns the force on the body,
    /// N.
    pub fn step(
        &mut self,
        wheel: &WheelParameters,
        g: f64,
        torque: f64,
        under: &Under,
        dt: f64,
    ) -> f64 {
        let r = wheel.radius;
        let half = 0.5 * dt / wheel.inertia;
        let rim = Rim {
            expected: r * self.expected(),
            free: r * (self.omega + half * torque),
            give: half * r * r,
        };
        self.contact.follow(under);
        let force = self.contact.turn(&wheel.bristle, g, under, &rim, dt);
        self.gained = half * (torque - r * force);
        self.omega += 2.0 * self.gained;
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

    /// A body of which nothing is known but its speed.
    fn at(v: f64) -> Under {
        Under {
            v: [v; 2],
            give: 0.0,
        }
    }

    #[test]
    fn a_sliding_contact_carries_exactly_its_limit() {
        let mut c = Contact::default();
        for _ in 0..200 {
            c.step(&B, 5000.0, &at(1.0), 2e-3);
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
        let mut c = Contact::default();
        let (mut x, mut v) = (0.0, 0.0);
        let mut settled = 0.0;
        for k in 0..60_000 {
            let shake = if (10_000..50_000).contains(&k) {
                500.0 * libm::sin(0.05 * k as f64)
            } else {
                0.0
            };
            v += dt / m * (2500.0 + shake + c.step(&B, 5000.0, &at(v), dt));
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
            c.step(&WHEEL, 10_000.0, 3000.0 * 0.17, &at(1.0), 1e-3);
        }
        let creep = (c.omega * 0.17 - 1.0) / (c.omega * 0.17);
        assert!((c.contact.force - 3000.0).abs() < 1e-3);
        assert!(
            (creep / (20.0 * 3000.0 / 1.2e7) - 1.0).abs() < 1e-3,
            "creep {creep}"
        );
    }

    #[test]
    fn torque_beyond_adhesion_spins_the_wheel_and_the_force_stays_at_its_limit() {
        let mut c = RollingContact::default();
        for _ in 0..1000 {
            c.step(&WHEEL, 4000.0, 2.0 * 4000.0 * 0.17, &at(0.0), 1e-3);
        }
        // On the spot v_r = ω r: the rolling term takes a share κ g/σ0 (0.7 %) off µN, and nothing takes more.
        assert!(
            c.contact.force <= 4000.0 && c.contact.force > 0.993 * 4000.0,
            "{}",
            c.contact.force
        );
        // J ω̇ = T − r F → after 1 s ω = (2 · 4000 − F) r / J.
        let omega = (2.0 * 4000.0 - c.contact.force) * 0.17 / 2.0;
        assert!((c.omega / omega - 1.0).abs() < 0.01, "{}", c.omega);
    }
}
