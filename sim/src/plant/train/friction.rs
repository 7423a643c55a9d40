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
//! A step is of second order: the mean of the force takes α and the decay of z in the middle of the step, and the wheel's
//! rate is solved with it, in closed form. It is known but for what the body's speed changes otherwise than expected.

use crate::train::springs::BRISTLE_SHARE;

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

/// Speed of a rim over a step, m/s; all 0 for a shoe, which does not turn.
#[derive(Clone, Copy, Debug, Default)]
struct Rim {
    /// In the middle of the step, if the rate goes on as in the last step.
    expected: f64,
    /// Before the step.
    before: f64,
    /// Change in the step without the force of the contact.
    free: f64,
    /// What each newton of the contact takes from it.
    give: f64,
}

/// A step of a contact until its body's speed is known.
#[derive(Clone, Copy, Debug, Default)]
struct Open {
    /// Force if the body's speed changes as expected, beyond the largest too, and the largest, N.
    force: f64,
    most: f64,
    /// What each m/s by which the body's speed changes more than expected takes from the force, N·s/m; 0 where nothing does.
    slope: f64,
    /// Mean slip without force, m/s, and what each newton takes from it.
    slip: [f64; 2],
    /// Shares of the deflection and of the way that are left at the end.
    shares: [f64; 2],
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
    open: Open,
}

impl Contact {
    /// Begins a step of `dt` with limit force `g` (N) under a body that is expected to have the speed `v` in its middle and
    /// to have `gained` so much (m/s) at its end; returns the force on the body, N, if that is so.
    pub fn begin(&mut self, b: &Bristle, g: f64, [v, gained]: [f64; 2], dt: f64) -> f64 {
        let (z_max, way) = (g / b.sigma0, 0.01 * dt * v.abs());
        if g > 0.0 && self.z * v < 0.0 && v.abs() > gained.abs() && z_max - self.z.abs() <= way {
            // At its limit within a hundredth of the step, and slides on: what the equations come to.
            (self.z, self.force) = (z_max.copysign(-v), g.copysign(-v));
            (self.slip, self.loss) = (-v, g * v.abs());
            self.open = Open::default();
            return self.force;
        }
        self.begin_rolling(b, g, [v, gained], &Rim::default(), dt)
    }

    /// Begins a step of a contact with a rim.
    fn begin_rolling(&mut self, b: &Bristle, g: f64, under: [f64; 2], rim: &Rim, dt: f64) -> f64 {
        let [v, gained] = under;
        let free = rim.before + 0.5 * rim.free - v;
        if g <= 0.0 {
            *self = Self::default();
            self.slip = free;
            return 0.0;
        }
        let z_max = g / b.sigma0;
        self.z = self.z.clamp(-z_max, z_max);
        let v_r = rim.expected - v;
        let rate = |z| b.alpha(z, v_r, z_max) * v_r.abs() / z_max + b.kappa * rim.expected.abs();
        let middle = self.z + 0.5 * dt * (v_r - rate(self.z) * self.z);
        let [left, mean, way] = decay(dt * rate(middle));
        let spring = b.sigma0 * way * dt;
        let damper = b.sigma1 * mean;
        let held = (b.sigma0 * mean - b.sigma1 * (1.0 - left) / dt) * self.z;
        let back = 2.0 * BRISTLE_SHARE * spring + 0.5 * damper;
        let before = rim.before - v + 0.5 * gained;
        let pull = held + (spring + damper) * before + back * (rim.free - gained);
        let force = pull / (1.0 + back * rim.give);
        self.force = force.clamp(-g, g);
        self.open = Open {
            force,
            most: g,
            slope: back / (1.0 + back * rim.give),
            slip: [free, 0.5 * rim.give],
            shares: [left, mean * dt],
        };
        self.force
    }

    /// Ends a step of `dt`: the body's speed has changed by `more` (m/s) than expected. Returns the force on it, N.
    pub fn end(&mut self, b: &Bristle, more: f64, dt: f64) -> f64 {
        let o = self.open;
        if o.slope == 0.0 {
            return self.force;
        }
        self.force = (o.force - o.slope * more).clamp(-o.most, o.most);
        self.slip = o.slip[0] - o.slip[1] * self.force - 0.5 * more;
        let (before, z_max) = (self.z, o.most / b.sigma0);
        self.z = (o.shares[0] * before + o.shares[1] * self.slip).clamp(-z_max, z_max);
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
    /// Change of the rate in the last step, rad/s.
    pub gained: f64,
    /// Half of what it has changed more than expected, rad/s.
    pub more: f64,
    /// Change without the force of the contact, rad/s, and for each N·m, 1/(kg·m²·s).
    open: [f64; 2],
}

impl RollingContact {
    /// A wheel that rolls freely at a rate, rad/s.
    pub fn at(omega: f64) -> Self {
        Self {
            omega,
            ..Self::default()
        }
    }

    /// Rate in the middle of the next step if it goes on as in the last one, rad/s.
    pub fn expected(&self) -> f64 {
        self.omega + 0.5 * self.gained
    }

    /// Begins a step of `dt`: limit force `g` (N), torque on the wheel at the expected rate and what each rad/s takes from
    /// it (N·m, N·m·s), speed of the body as in [`Contact::begin`]. Returns the force on the body, N.
    pub fn begin(
        &mut self,
        wheel: &WheelParameters,
        g: f64,
        [torque, damping]: [f64; 2],
        under: [f64; 2],
        dt: f64,
    ) -> f64 {
        let (r, per_torque) = (wheel.radius, dt / (wheel.inertia + 0.5 * dt * damping));
        let free = per_torque * (torque + 0.5 * damping * self.gained);
        let rim = Rim {
            expected: r * self.expected(),
            before: r * self.omega,
            free: r * free,
            give: per_torque * r * r,
        };
        self.open = [free, per_torque];
        self.contact
            .begin_rolling(&wheel.bristle, g, under, &rim, dt)
    }

    /// Ends a step as [`Contact::end`].
    pub fn end(&mut self, wheel: &WheelParameters, more: f64, dt: f64) -> f64 {
        let force = self.contact.end(&wheel.bristle, more, dt);
        let [free, per_torque] = self.open;
        let gained = free - per_torque * wheel.radius * force;
        self.more = 0.5 * (gained - self.gained);
        self.gained = gained;
        self.omega += gained;
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

    /// Steps a shoe under a body of which nothing is known but its speed; returns its force.
    fn step(c: &mut Contact, g: f64, v: f64, dt: f64) -> f64 {
        c.begin(&B, g, [v, 0.0], dt);
        c.end(&B, 0.0, dt)
    }

    /// The same of a wheel under a torque.
    fn roll(c: &mut RollingContact, g: f64, torque: f64, v: f64) {
        c.begin(&WHEEL, g, [torque, 0.0], [v, 0.0], 1e-3);
        c.end(&WHEEL, 0.0, 1e-3);
    }

    #[test]
    fn a_sliding_contact_carries_exactly_its_limit() {
        let mut c = Contact::default();
        for _ in 0..200 {
            step(&mut c, 5000.0, 1.0, 2e-3);
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
            v += dt / m * (2500.0 + shake + step(&mut c, 5000.0, v, dt));
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
        let mut c = RollingContact::at(1.0 / 0.17);
        for _ in 0..20_000 {
            roll(&mut c, 10_000.0, 3000.0 * 0.17, 1.0);
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
            roll(&mut c, 4000.0, 2.0 * 4000.0 * 0.17, 0.0);
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
