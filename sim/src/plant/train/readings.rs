//! Readings of the force laws and their states between steps: energy, momentum, wheel rates, internal states.

use super::body_state::BodyState;
use super::coupling;
use super::dynamics::{CLAMP_ROLL_STIFFNESS, DriveUnit, Dynamics};
use super::friction::RollingContact;
use super::resistance;
use super::running_gear;
use crate::rail::Rail;

impl Dynamics {
    /// Energy stored in springs and bristles, and of the turning wheels, J.
    pub fn stored_energy(&self, rail: &Rail, bodies: &[BodyState]) -> f64 {
        let mut e = 0.0;
        let mut cursors = self.cursors.iter().copied();
        for (i, spec) in self.train.bodies.iter().enumerate() {
            for st in &spec.stations {
                let Some(mut cursor) = cursors.next() else {
                    break;
                };
                let at = bodies[i].p + bodies[i].r.column(0) * st.x_m;
                let f = rail.track(&at, &mut cursor);
                e += running_gear::stored(st, &bodies[i], &at, &f);
            }
        }
        for r in &self.rolling {
            e += 0.5 * resistance::ROLLING.sigma0 * r.z * r.z;
        }
        for c in &self.train.connections {
            e += coupling::stored(c, &bodies[c.a], &bodies[c.b]);
        }
        for u in &self.drives {
            let d = &u.spec;
            let inertia = d.friction_wheel().inertia;
            for w in &u.wheels {
                e += 0.5 * d.sigma0 * w.z * w.z + 0.5 * inertia * w.omega * w.omega;
            }
            e += 0.5 * d.sigma0 * u.shoes.z * u.shoes.z;
            let mut cursor = u.cursor;
            let body = &bodies[d.body];
            let f = rail.track(&body.point(&d.contact), &mut cursor);
            let roll = body.r.column(1).dot(&f.u);
            e += 0.5 * CLAMP_ROLL_STIFFNESS * roll * roll;
        }
        e
    }

    /// Returns the momentum of the turning wheels and motors at the rim, Σ J ω / r, kg·m/s, and its mass, Σ J / r², kg.
    pub fn rotating_momentum(&self) -> (f64, f64) {
        let (mut momentum, mut mass) = (0.0, 0.0);
        for u in &self.drives {
            let w = u.spec.friction_wheel();
            for wheel in &u.wheels {
                momentum += w.inertia * wheel.omega / w.radius;
                mass += w.inertia / (w.radius * w.radius);
            }
        }
        (momentum, mass)
    }

    /// Internal states that the motion changes: rates of the friction wheels, rad/s, then deflections of the bristles
    /// of wheels, brake shoes and rolling resistances, m.
    pub fn internals(&self) -> Vec<f64> {
        let wheels = || self.drives.iter().flat_map(|u| &u.wheels);
        let rates = wheels().map(|w| w.omega);
        let bristles = wheels().map(|w| w.z);
        let shoes = self.drives.iter().map(|u| u.shoes.z);
        let rolling = self.rolling.iter().map(|r| r.z);
        rates.chain(bristles).chain(shoes).chain(rolling).collect()
    }

    /// Sets the internal states, in the order of [`Dynamics::internals`].
    pub fn set_internals(&mut self, values: &[f64]) {
        let mut values = values.iter().copied();
        let mut set = |x: &mut f64| *x = values.next().unwrap_or(*x);
        let wheels = |drives: &mut [DriveUnit], set: &mut dyn FnMut(&mut RollingContact)| {
            drives.iter_mut().flat_map(|u| &mut u.wheels).for_each(set);
        };
        wheels(&mut self.drives, &mut |w| set(&mut w.omega));
        wheels(&mut self.drives, &mut |w| set(&mut w.z));
        self.drives.iter_mut().for_each(|u| set(&mut u.shoes.z));
        self.rolling.iter_mut().for_each(|r| set(&mut r.z));
    }

    /// Rates of the friction wheels of drive `i` (left, right), rad/s, at the end of a step of `dt` (s) that has
    /// brought the bodies here.
    ///
    /// A step solves the wheels with the speed of the web before it. What a wheel that holds then has is its slip; its
    /// rate at the end is that of the web at the end and the same slip. A wheel that slides turns by its torque alone.
    pub fn wheel_rates(&self, i: usize, bodies: &[BodyState], dt: f64) -> [f64; 2] {
        let unit = &self.drives[i];
        if dt <= 0.0 {
            return unit.wheels.map(|w| w.omega);
        }
        let (at, f) = &unit.contact;
        // where the contact has gone, and how the rail has turned, in the step
        let way = unit.v_t * dt;
        let t = f.t + f.k * way;
        let now = bodies[unit.spec.body].velocity(&(at + f.t * way)).dot(&t);
        let gained = (now - unit.v_t) / unit.spec.wheel_radius_m;
        unit.wheels
            .map(|w| w.omega + (1.0 - w.sliding_share) * gained)
    }
}
