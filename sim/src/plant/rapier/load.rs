//! Change of the load: mass that is hung on brings its momentum, mass that is set down takes its own away.

use super::World;
use crate::train::inertia::MassProperties;
use nalgebra::{Matrix3, Vector3};

/// A part of a body: mass, centre of mass and inertia in the world, velocity and angular velocity.
struct MovingMass {
    mass: f64,
    c: Vector3<f64>,
    inertia: Matrix3<f64>,
    v: Vector3<f64>,
    w: Vector3<f64>,
}

impl World {
    /// Give the payload another mass, kg. What is hung on has `speed` (m/s) along the rail and does not turn, or
    /// without that moves with the load; it and the load have one motion afterwards, with the momentum and angular
    /// momentum of both.
    pub(super) fn change_load(&mut self, mass_kg: f64, speed: Option<f64>) {
        let train = &mut self.dynamics.train;
        let (Some(i), Some(payload)) = (train.load, &mut train.payload) else {
            return;
        };
        let added = mass_kg - payload.mass_kg;
        payload.mass_kg = mass_kg;
        let now = payload.body_with(mass_kg);
        let hung = payload.nominal;
        let body = &mut train.bodies[i];
        let before = MassProperties {
            mass_kg: body.mass_kg,
            com: body.com,
            inertia: body.inertia,
        };
        (body.mass_kg, body.com, body.inertia) = (now.mass_kg, now.com, now.inertia);
        let s = self.bodies.states()[i];
        let part = |m: &MassProperties, v: Vector3<f64>, w: Vector3<f64>| MovingMass {
            mass: m.mass_kg,
            c: s.point(&m.com),
            inertia: s.r * m.inertia * s.r.transpose(),
            v,
            w,
        };
        let c = s.point(&now.com);
        let (v, w) = match speed {
            Some(speed) if added > 0.0 => {
                let along = self.dynamics.directions().now()[i] * speed;
                let hung = part(&hung.scaled_to(added), along, Vector3::zeros());
                joined(&part(&before, s.v, s.w), &hung, &part(&now, s.v, s.w))
            }
            // The motion of the load goes on: its centre of mass has moved within it.
            _ => (s.velocity(&c), s.w),
        };
        self.bodies.set_mass(i, &self.dynamics.train.bodies[i]);
        self.bodies.set_velocity(i, v, w);
        self.dynamics.distribute_masses();
    }
}

/// Velocity and angular velocity of two parts that have become one body.
fn joined(a: &MovingMass, b: &MovingMass, both: &MovingMass) -> (Vector3<f64>, Vector3<f64>) {
    let v = (a.v * a.mass + b.v * b.mass) / both.mass;
    let spin = |p: &MovingMass| p.inertia * p.w + (p.c - both.c).cross(&((p.v - v) * p.mass));
    let turning = spin(a) + spin(b);
    let w = both.inertia.cholesky().map_or(a.w, |j| j.solve(&turning));
    (v, w)
}
