//! The train as rigid bodies in rapier. No other folder uses rapier.
//!
//! rapier handles collisions of cabs, beam and load with obstacles (`collisions`) and integrates the rigid bodies
//! meanwhile; while nothing can touch they are integrated by the same arithmetic without its pipeline (`bodies`,
//! `free_motion`). The forces between wheels and rail come from [`Dynamics`], computed on the analytic rail; why wheels
//! do not use the contact solver is described in `ARCHITECTURE.md`.

mod bodies;
mod clearance;
mod collisions;
mod convert;
mod free_motion;
mod load;
mod momentum;
#[cfg(test)]
mod order_tests;
mod sway;
mod truth;

use crate::error::Error;
use crate::plant::PlantOptions;
use crate::plant::train::balance::ForceBalance;
use crate::plant::train::body_state::{BodyState, Wrench};
use crate::plant::train::dynamics::{Dynamics, Sums};
use crate::plant::{Plant, Truth};
use crate::rail::{Cursor, Rail};
use crate::train::Train;
use bodies::Bodies;
use monorig_estimators::api::signals::Command;
use nalgebra::Vector3;
use std::sync::Arc;
use sway::Sway;

/// Distance beyond which a station has left the rail, m (half an I140E flange).
const MAX_OFF_RAIL_M: f64 = 0.034;
/// Longest time in which the train settles on its springs before a run, s, its longest step, s, and share of each
/// velocity kept in a step.
const SETTLE_S: f64 = 20.0;
const SETTLE_STEP_S: f64 = 4e-3;
const SETTLE_KEEP: f64 = 0.98;
/// Speed below which the train has settled, m/s.
const SETTLED_SPEED_MPS: f64 = 1e-5;
/// Number of steps at rest before a body counts as settled, so that a turning point of a swing does not count as rest.
const SETTLED_STEPS: u32 = 125;

/// The train in rapier.
pub struct World {
    rail: Arc<Rail>,
    dynamics: Dynamics,
    bodies: Bodies,
    wrenches: Vec<Wrench>,
    truth: Truth,
    sums: Sums,
    balance: ForceBalance,
    imu: (usize, Cursor),
    sway: Option<Sway>,
    mounts: Vec<usize>,
    drive_work_j: f64,
    lost_j: f64,
    rail_impulse: Vector3<f64>,
    time: SimulatedTime,
}

/// Time as a count of whole nanoseconds, so that a day of steps does not drift.
#[derive(Clone, Copy, Debug, Default)]
struct SimulatedTime(i64);

impl SimulatedTime {
    fn advance(&mut self, dt: f64) -> f64 {
        self.0 += libm::round(dt * 1e9) as i64;
        self.0 as f64 * 1e-9
    }
}

impl World {
    /// Put a train on a rail and let it settle.
    pub fn new(train: Train, rail: Arc<Rail>, options: &PlantOptions) -> Result<Self, Error> {
        let bodies = Bodies::new(&train, &rail, options);
        let mut dynamics = Dynamics::new(train, &rail, options.front_m, options.gravity_mps2);
        dynamics.zones.clone_from(&options.zones);
        let imu_start = options.front_m
            + dynamics.train.bodies[dynamics.train.mounts[options.imu].body].start_s;
        let mut world = Self {
            sway: Sway::of(&dynamics.train),
            imu: (options.imu, Cursor::at(imu_start)),
            rail,
            wrenches: vec![Wrench::ZERO; bodies.states().len()],
            bodies,
            truth: Truth::default(),
            sums: Sums::default(),
            balance: ForceBalance::default(),
            mounts: options.mounts.clone(),
            dynamics,
            drive_work_j: 0.0,
            lost_j: 0.0,
            rail_impulse: Vector3::zeros(),
            time: SimulatedTime::default(),
        };
        world.settle(options.front_m, options.speed_mps)?;
        Ok(world)
    }

    /// Let the springs take the weight with brakes on, then give every body its speed.
    fn settle(&mut self, front: f64, speed: f64) -> Result<(), Error> {
        let dt = SETTLE_STEP_S.min(self.dynamics.train.longest_step().0);
        let command = Command {
            brake: 1.0,
            clamp_pressure_mpa: self
                .dynamics
                .drives
                .iter()
                .map(|d| d.spec.clamp_mpa)
                .fold(0.0, f64::max),
            ..Default::default()
        };
        for u in &mut self.dynamics.drives {
            u.brake.value = u.spec.brake_max_n;
        }
        let mut quiet = 0;
        for _ in 0..(SETTLE_S / dt) as usize {
            self.bodies.reach_middle(dt);
            self.forces(&command, dt);
            self.bodies.step(&self.wrenches, self.truth.t_s, dt);
            let mut fastest: f64 = 0.0;
            for i in 0..self.wrenches.len() {
                let s = &self.bodies.states()[i];
                let (v, w) = (s.v * SETTLE_KEEP, s.w * SETTLE_KEEP);
                fastest = fastest.max(v.norm());
                self.bodies.set_velocity(i, v, w);
            }
            quiet = if fastest < SETTLED_SPEED_MPS {
                quiet + 1
            } else {
                0
            };
            if quiet > SETTLED_STEPS {
                break;
            }
        }
        self.drive_work_j = 0.0;
        self.lost_j = 0.0;
        self.rail_impulse = Vector3::zeros();
        if speed != 0.0 {
            for (i, b) in self.dynamics.train.bodies.iter().enumerate() {
                // A body moves along the tangent at its own place on the rail.
                let mut cursor = Cursor::at(front + b.start_s);
                let s = &self.bodies.states()[i];
                let t = self.rail.track(&s.p, &mut cursor).t;
                self.bodies.set_velocity(i, t * speed, s.w);
            }
            self.dynamics.roll(speed);
        }
        self.time = SimulatedTime::default();
        let (train, bodies) = (&self.dynamics.train, self.wrenches.len());
        self.truth = Truth::with_room(train.mounts.len(), train.drives.len(), bodies);
        self.update_truth(0.0);
        self.truth.accel_mps2 = 0.0;
        self.check()
    }

    /// Forces of a step of `dt` (s), with the internal states behind it.
    fn forces(&mut self, command: &Command, dt: f64) {
        self.sums = self.dynamics.forces(
            &self.rail,
            self.bodies.states(),
            command,
            dt,
            &mut self.wrenches,
        );
    }

    /// Checks that the train is on the rail and its motion is finite.
    fn check(&self) -> Result<(), Error> {
        let off = self.sums.off_rail_m;
        let broken = |what: String| {
            Err(Error::Broken {
                t_s: self.truth.t_s,
                what,
            })
        };
        if !(self.truth.speed_mps.is_finite() && off.is_finite()) {
            return broken(
                "the motion is no longer finite: a stiffness is too high for the step".into(),
            );
        }
        if off > MAX_OFF_RAIL_M {
            return broken(format!("a wheel is {:.0} mm off the rail", off * 1e3));
        }
        Ok(())
    }

    /// The force laws and their states.
    pub fn dynamics(&self) -> &Dynamics {
        &self.dynamics
    }

    /// Motion of every body.
    pub fn bodies(&self) -> &[BodyState] {
        self.bodies.states()
    }

    /// Sums of the last step.
    pub fn sums(&self) -> &Sums {
        &self.sums
    }

    /// Impulse of the rail on the train since the start, N·s, world.
    pub fn rail_impulse(&self) -> Vector3<f64> {
        self.rail_impulse
    }

    /// Energy now, J: kinetic and potential of the bodies, springs, bristles and turning masses.
    pub fn energy(&self) -> f64 {
        let states = self.bodies.states();
        let mut e = self.dynamics.stored_energy(&self.rail, states);
        for (s, b) in states.iter().zip(&self.dynamics.train.bodies) {
            let w = s.r.transpose() * s.w;
            e += b.mass_kg * (0.5 * s.v.norm_squared() + self.dynamics.gravity * s.c.z)
                + 0.5 * w.dot(&(b.inertia * w));
        }
        e
    }

    /// Work of the motors, and energy lost, J, since the start.
    pub fn work(&self) -> (f64, f64) {
        (self.drive_work_j, self.lost_j)
    }

    /// Give a body a velocity by hand (tests).
    pub fn set_velocity(&mut self, body: usize, v: Vector3<f64>) {
        let w = self.bodies.states()[body].w;
        self.bodies.set_velocity(body, v, w);
    }

    /// Advance the bodies by rapier's whole pipeline in every step from now on (`true`), or only while something could
    /// touch (tests).
    pub fn set_engine_always(&mut self, on: bool) {
        self.bodies.set_engine_always(on);
    }
}

impl Plant for World {
    fn step(&mut self, command: &Command, dt_s: f64) -> Result<(), Error> {
        let before = self.momentum();
        self.bodies.reach_middle(dt_s);
        self.forces(command, dt_s);
        let turned = self.bodies_momentum(-0.5);
        self.bodies.step(&self.wrenches, self.truth.t_s, dt_s);
        self.update_balance(&before, turned, dt_s);
        self.drive_work_j += self.sums.drive_w * dt_s;
        self.lost_j += self.sums.loss_w * dt_s;
        self.rail_impulse += self.sums.external * dt_s;
        self.truth.t_s = self.time.advance(dt_s);
        self.update_truth(dt_s);
        self.check()
    }

    fn truth(&self) -> &Truth {
        &self.truth
    }

    fn set_load_mass(&mut self, mass_kg: f64, speed_mps: Option<f64>) {
        self.change_load(mass_kg, speed_mps);
    }

    fn set_clamp_limit(&mut self, mpa: f64) {
        self.dynamics.clamp_limit_mpa = mpa;
    }

    fn diverging_body(&self) -> Option<&str> {
        let motion = |s: &BodyState| match s.v.norm() + s.w.norm() + s.p.norm() {
            x if x.is_finite() => s.v.norm(),
            _ => f64::INFINITY,
        };
        let states = self.bodies.states().iter().enumerate();
        let fastest = states.max_by(|(_, a), (_, b)| motion(a).total_cmp(&motion(b)));
        let body = self.dynamics.train.bodies.get(fastest?.0)?;
        Some(&body.name)
    }

    fn update_clearance(&mut self) {
        self.truth.clearance_m = self.bodies.clearance();
    }
}
