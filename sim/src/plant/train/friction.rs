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
//! A step is of second order: the mean of the force takes α and the decay of z in the middle of the step, and the
//! wheel's rate is solved with it, in closed form. It is known but for what the body's speed changes otherwise than
//! expected.

use crate::train::springs::BRISTLE_SHARE;

/// Below this share of the largest deflection the bristles are purely elastic.
const BREAK_AWAY_SHARE: f64 = 0.7;
/// As near to the largest deflection, m, what does not turn slides at its limit: way of some microseconds.
const SLIDING_WITHIN_M: f64 = 5e-6;

/// Parameters of a contact, and of the wheel that makes it.
#[derive(Clone, Copy, Debug)]
pub struct Bristle {
    /// Bristle stiffness, N/m.
    pub sigma0: f64,
    /// Bristle damping, N·s/m.
    pub sigma1: f64,
    /// Rolling term, 1/m.
    pub kappa: f64,
    /// Radius of the wheel, m; 0 for what does not turn: a brake shoe, or a station with its rolling resistance.
    pub radius: f64,
    /// Inertia of the wheel about its axle, with its share of the motor, kg·m².
    pub inertia: f64,
}

/// Elasto-plastic transition α: 0 elastic … 1 sliding, at a share of the largest deflection in the direction of the
/// slip.
fn sliding(share: f64) -> f64 {
    const PER_SHARE: f64 = 1.0 / (1.0 - BREAK_AWAY_SHARE);
    let x = ((share - BREAK_AWAY_SHARE) * PER_SHARE).clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// A step of a contact until its body's speed is known.
#[derive(Clone, Copy, Debug, Default)]
struct OpenStep {
    /// Force if the body's speed changes as expected, beyond the largest too, and the largest, N.
    force: f64,
    most: f64,
    /// Loss of the force for each m/s by which the body's speed changes more than expected, N·s/m; 0 where there is
    /// none.
    slope: f64,
    /// Shares of the deflection and of the way that are left at the end.
    shares: [f64; 2],
    /// Change of the wheel's rate without the force of the contact, rad/s, and for each N·m, 1/(kg·m²·s).
    turn: [f64; 2],
}

/// Bristles between a body and the rail, with the friction wheel that they are on, if it is one.
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
    /// Wheel rate, rad/s.
    pub omega: f64,
    /// Change of the rate in the last step, rad/s.
    pub gained: f64,
    /// Half of what it has changed more than expected, rad/s.
    pub more: f64,
    open: OpenStep,
}

impl Contact {
    /// A wheel that rolls freely at a rate, rad/s.
    pub fn rolling(omega: f64) -> Self {
        Self {
            omega,
            ..Self::default()
        }
    }

    /// Rate in the middle of the next step if it goes on as in the last one, rad/s.
    pub fn expected(&self) -> f64 {
        self.omega + 0.5 * self.gained
    }

    /// Begins a step of `dt`: limit force `g` (N), torque on the wheel at the expected rate and what each rad/s takes
    /// from it (N·m, N·m·s), under a body that is expected to have the speed `v` in the middle of the step and to have
    /// `gained` so much (m/s) at its end. Returns the force on the body, N, if that is so.
    pub fn begin(
        &mut self,
        b: &Bristle,
        g: f64,
        [torque, damping]: [f64; 2],
        [v, gained]: [f64; 2],
        dt: f64,
    ) -> f64 {
        self.open = OpenStep::default();
        if b.radius == 0.0 && self.slides(b, g, v, gained) {
            return self.force;
        }
        let per_torque = dt / (b.inertia + 0.5 * dt * damping);
        let turned = per_torque * (torque + 0.5 * damping * self.gained);
        let (before, free) = (b.radius * self.omega, b.radius * turned);
        self.open.turn = [turned, per_torque];
        self.slip = before + 0.5 * free - v;
        if g <= 0.0 {
            (self.z, self.force, self.loss) = (0.0, 0.0, 0.0);
            return 0.0;
        }
        let z_max = g / b.sigma0;
        let rim = b.radius * self.expected();
        let v_r = rim - v;
        self.z = self.z.clamp(-z_max, z_max);
        let per_way = b.sigma0 / g;
        let share = per_way.copysign(v_r);
        let rate = |z| sliding(z * share) * v_r.abs() * per_way + b.kappa * rim.abs();
        let middle = self.z + 0.5 * dt * (v_r - rate(self.z) * self.z);
        let rate = rate(middle);
        let [left, mean, way] = decay(dt * rate);
        let spring = b.sigma0 * way * dt;
        let damper = b.sigma1 * mean;
        let held = (b.sigma0 * mean - damper * rate) * self.z;
        let back = 2.0 * BRISTLE_SHARE * spring + 0.5 * damper;
        let pull = held + (spring + damper) * (before - v + 0.5 * gained) + back * (free - gained);
        let kept = 1.0 / (1.0 + back * per_torque * b.radius * b.radius);
        self.open.force = pull * kept;
        self.open.most = g;
        self.open.slope = back * kept;
        self.open.shares = [left, mean * dt];
        self.force = self.open.force.clamp(-g, g);
        self.force
    }

    /// Slides on at its limit, if it is there, which is what the equations come to.
    fn slides(&mut self, b: &Bristle, g: f64, v: f64, gained: f64) -> bool {
        let z_max = g / b.sigma0;
        let slides = g > 0.0
            && self.z * v < 0.0
            && self.z.abs() >= z_max - SLIDING_WITHIN_M
            && v.abs() > gained.abs();
        if slides {
            (self.z, self.force) = (z_max.copysign(-v), g.copysign(-v));
            (self.slip, self.loss) = (-v, g * v.abs());
        }
        slides
    }

    /// Ends a step of `dt`: the body's speed has changed by `more` (m/s) than expected. Returns the force on it, N.
    pub fn end(&mut self, b: &Bristle, more: f64, dt: f64) -> f64 {
        let o = self.open;
        if o.slope == 0.0 && b.radius == 0.0 {
            return self.force;
        }
        let [turned, per_torque] = o.turn;
        if o.slope > 0.0 {
            self.force = (o.force - o.slope * more).clamp(-o.most, o.most);
            self.slip -= 0.5 * (b.radius * b.radius * per_torque * self.force + more);
            let (before, z_max) = (self.z, o.most / b.sigma0);
            self.z = (o.shares[0] * before + o.shares[1] * self.slip).clamp(-z_max, z_max);
            let stored = 0.5 * b.sigma0 * (self.z * self.z - before * before) / dt;
            self.loss = self.force * self.slip - stored;
        }
        let gained = turned - per_torque * b.radius * self.force;
        self.more = 0.5 * (gained - self.gained);
        self.gained = gained;
        self.omega += gained;
        self.force
    }
}

/// Shares of a value that decays with e⁻ʰ in a step: what is left of it, its mean, and the mean of what comes in
/// evenly. The rational form 1/(1 + h + h²/2) is of second order, and 0 for a decay that is faster than any step.
fn decay(h: f64) -> [f64; 3] {
    let left = 1.0 / (1.0 + h + 0.5 * h * h);
    [left, (1.0 + 0.5 * h) * left, 0.5 * (1.0 + h) * left]
}

#[cfg(test)]
mod tests {
    use super::*;

    const B: Bristle = Bristle {
        sigma0: 1.2e7,
        sigma1: 2e4,
        kappa: 20.0,
        radius: 0.0,
        inertia: f64::INFINITY,
    };

    const WHEEL: Bristle = Bristle {
        inertia: 2.0,
        radius: 0.17,
        ..B
    };

    /// Steps a shoe under a body of which nothing is known but its speed; returns its force.
    fn step(c: &mut Contact, g: f64, v: f64, dt: f64) -> f64 {
        c.begin(&B, g, [0.0; 2], [v, 0.0], dt);
        c.end(&B, 0.0, dt)
    }

    /// The same of a wheel under a torque.
    fn roll(c: &mut Contact, g: f64, torque: f64, v: f64) {
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
        let mut c = Contact::rolling(1.0 / 0.17);
        for _ in 0..20_000 {
            roll(&mut c, 10_000.0, 3000.0 * 0.17, 1.0);
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
        let mut c = Contact::default();
        for _ in 0..1000 {
            roll(&mut c, 4000.0, 2.0 * 4000.0 * 0.17, 0.0);
        }
        // On the spot v_r = ω r: the rolling term takes a share κ g/σ0 (0.7 %) off µN, and nothing takes more.
        assert!(c.force <= 4000.0 && c.force > 0.993 * 4000.0, "{}", c.force);
        // J ω̇ = T − r F → after 1 s ω = (2 · 4000 − F) r / J.
        let omega = (2.0 * 4000.0 - c.force) * 0.17 / 2.0;
        assert!((c.omega / omega - 1.0).abs() < 0.01, "{}", c.omega);
    }
}
