//! Readings of the force laws and their states between steps: energy, momentum, wheel rates, internal states.

use super::body_state::BodyState;
use super::coupling;
use super::dynamics::{CLAMP_ROLL_STIFFNESS, Dynamics};
use super::friction::Contact;
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
            let inertia = d.turning_inertia();
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
            let (inertia, radius) = (u.spec.turning_inertia(), u.spec.wheel_radius_m);
            for wheel in &u.wheels {
                momentum += inertia * wheel.omega / radius;
                mass += inertia / (radius * radius);
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
        let mut next = || values.next().unwrap_or_default();
        let mut wheels: Vec<_> = self.drives.iter_mut().flat_map(|u| &mut u.wheels).collect();
        wheels
            .iter_mut()
            .for_each(|w| (w.omega, w.gained) = (next(), 0.0));
        wheels.iter_mut().for_each(|w| w.z = next());
        let shoes = self.drives.iter_mut().map(|u| &mut u.shoes);
        shoes.chain(&mut self.rolling).for_each(|c| c.z = next());
    }

    /// Lets the wheels roll at a speed (m/s) from now on, with open brakes.
    pub(crate) fn roll(&mut self, speed: f64) {
        for u in &mut self.drives {
            (u.brake.value, u.shoes) = (0.0, Contact::default());
            u.wheels = [Contact::rolling(speed / u.spec.wheel_radius_m); 2];
        }
        self.rolling.fill(Contact::default());
    }
}
