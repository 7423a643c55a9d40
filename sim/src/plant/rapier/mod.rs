//! The train as rigid bodies in rapier. No other folder uses rapier.
//!
//! rapier integrates the rigid bodies and handles collisions of cabs, beam and load with obstacles (`collisions`). The
//! forces between wheels and rail come from [`Dynamics`], computed on the analytic rail; why wheels do not use the contact
//! solver is described in `docs/src/design.md`.

mod clearance;
mod collisions;
mod convert;
mod load;
mod momentum;
mod truth;

use crate::error::Error;
use crate::plant::PlantOptions;
use crate::plant::train::balance::ForceBalance;
use crate::plant::train::body_state::{BodyState, Wrench};
use crate::plant::train::dynamics::{Dynamics, Sums};
use crate::plant::{DriveState, MountState, Plant, Truth};
use crate::rail::{Cursor, Rail};
use crate::train::Train;
use collisions::Collisions;
use convert::{mass_properties, pose_to_rapier, state, to_rapier};
use monorig_estimators::api::signals::Command;
use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};
use rapier3d::math::Vector;
use rapier3d::prelude::{FrictionModel, PhysicsWorld, RigidBodyBuilder, RigidBodyHandle};
use std::sync::Arc;
use truth::Sway;

/// A station farther from the rail than this has left it, m (half an I140E flange).
const MAX_OFF_RAIL_M: f64 = 0.034;
/// Before a run the train settles on its springs for at most this long, s, in steps of 1 ms with this much of each velocity kept.
const SETTLE_S: f64 = 20.0;
const SETTLE_KEEP: f64 = 0.995;
/// Speed below which it has settled, m/s.
const SETTLED_SPEED_MPS: f64 = 1e-7;
/// For so many steps, so that a turning point of a swing is not taken for rest.
const SETTLED_STEPS: u32 = 500;
/// The train in rapier.
pub struct World {
    rail: Arc<Rail>,
    dynamics: Dynamics,
    physics: PhysicsWorld,
    handles: Vec<RigidBodyHandle>,
    collisions: Collisions,
    states: Vec<BodyState>,
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
    time: Clock,
}

/// Time as a count of whole nanoseconds, so that a day of steps does not drift.
#[derive(Clone, Copy, Debug, Default)]
struct Clock(i64);

impl Clock {
    fn advance(&mut self, dt: f64) -> f64 {
        self.0 += libm::round(dt * 1e9) as i64;
        self.0 as f64 * 1e-9
    }
}

impl World {
    /// Put a train on a rail and let it settle.
    pub fn new(train: Train, rail: Arc<Rail>, options: &PlantOptions) -> Result<Self, Error> {
        let mut physics = PhysicsWorld {
            gravity: Vector::new(0.0, 0.0, -options.gravity_mps2),
            ..Default::default()
        };
        let p = &mut physics.integration_parameters;
        p.num_solver_iterations = 1;
        p.max_ccd_substeps = 0;
        p.contact_recycling = false;
        p.friction_model = FrictionModel::Coulomb;

        let mut collisions = Collisions::new(&mut physics, &rail, &options.obstacles);
        let mut handles = Vec::new();
        for (i, b) in train.bodies.iter().enumerate() {
            let f = rail.frame(options.front_m + b.start_s);
            let x_wr = Isometry3::from_parts(
                Translation3::from(f.p),
                UnitQuaternion::from_matrix(&Matrix3::from_columns(&[f.t, f.l, f.u])),
            );
            let body = RigidBodyBuilder::dynamic()
                .pose(pose_to_rapier(&(x_wr * b.start_pose)))
                .additional_mass_properties(mass_properties(b))
                .can_sleep(false)
                .gyroscopic_forces_enabled(true);
            let handle = physics.bodies.insert(body);
            collisions.add(&mut physics, handle, b, Some(i) == train.load);
            handles.push(handle);
        }
        // Masses and centres of mass read 0 until the first step.
        physics.integration_parameters.dt = 0.0;
        physics.step();

        let mut dynamics = Dynamics::new(train, &rail, options.front_m, options.gravity_mps2);
        dynamics.zones.clone_from(&options.zones);
        let n = handles.len();
        let imu_start = options.front_m
            + dynamics.train.bodies[dynamics.train.mounts[options.imu].body].start_s;
        let mut world = Self {
            sway: Sway::of(&dynamics.train),
            imu: (options.imu, Cursor::at(imu_start)),
            rail,
            physics,
            handles,
            collisions,
            states: Vec::with_capacity(n),
            wrenches: vec![Wrench::ZERO; n],
            truth: Truth::default(),
            sums: Sums::default(),
            balance: ForceBalance::default(),
            mounts: options.mounts.clone(),
            dynamics,
            drive_work_j: 0.0,
            lost_j: 0.0,
            rail_impulse: Vector3::zeros(),
            time: Clock::default(),
        };
        world.read_states();
        world.settle(options.front_m, options.speed_mps)?;
        Ok(world)
    }

    /// Let the springs take the weight with brakes on, then give every body its speed.
    fn settle(&mut self, front: f64, speed: f64) -> Result<(), Error> {
        let dt = 1e-3;
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
            self.advance(&command, dt);
            let mut fastest: f64 = 0.0;
            for h in &self.handles {
                let b = &mut self.physics.bodies[*h];
                let (v, w) = (b.linvel() * SETTLE_KEEP, b.angvel() * SETTLE_KEEP);
                fastest = fastest.max(v.length());
                b.set_linvel(v, false);
                b.set_angvel(w, false);
            }
            self.read_states();
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
            let bodies = &self.dynamics.train.bodies;
            for ((h, s), b) in self.handles.iter().zip(&self.states).zip(bodies) {
                // A body moves along the tangent at its own place on the rail.
                let mut cursor = Cursor::at(front + b.start_s);
                let t = self.rail.track(&s.p, &mut cursor).t;
                self.physics.bodies[*h].set_linvel(to_rapier(&(t * speed)), false);
            }
            for u in &mut self.dynamics.drives {
                u.brake.value = 0.0;
                u.shoes = Default::default();
                for w in &mut u.wheels {
                    w.omega = speed / u.spec.wheel_radius_m;
                }
            }
            self.read_states();
        }
        self.time = Clock::default();
        self.truth = Truth {
            mounts: vec![
                MountState {
                    v_w: Vector3::zeros(),
                    q_wm: UnitQuaternion::identity(),
                    w_w: Vector3::zeros()
                };
                self.dynamics.train.mounts.len()
            ],
            drives: vec![DriveState::default(); self.dynamics.drives.len()],
            poses: vec![(Vector3::zeros(), UnitQuaternion::identity()); self.handles.len()],
            clearance_m: f64::INFINITY,
            ..Default::default()
        };
        self.update_truth(0.0);
        self.truth.accel_mps2 = 0.0;
        self.check()
    }

    /// One step of forces and rapier.
    fn advance(&mut self, command: &Command, dt: f64) {
        self.sums = self
            .dynamics
            .forces(&self.rail, &self.states, command, dt, &mut self.wrenches);
        for (h, w) in self.handles.iter().zip(&self.wrenches) {
            let b = &mut self.physics.bodies[*h];
            b.reset_forces(false);
            b.reset_torques(false);
            b.add_force(to_rapier(&w.force), false);
            b.add_torque(to_rapier(&w.torque), false);
        }
        self.collisions
            .update_colliders(&mut self.physics, self.truth.t_s);
        self.physics.integration_parameters.dt = dt;
        self.physics.step();
    }

    fn read_states(&mut self) {
        self.states.clear();
        let bodies = &self.physics.bodies;
        self.states
            .extend(self.handles.iter().map(|h| state(&bodies[*h])));
    }

    /// Still on the rail, still finite?
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
        &self.states
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
        let mut e = self.dynamics.stored_energy(&self.rail, &self.states);
        for (s, b) in self.states.iter().zip(&self.dynamics.train.bodies) {
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
        self.physics.bodies[self.handles[body]].set_linvel(to_rapier(&v), false);
        self.read_states();
    }
}

impl Plant for World {
    fn step(&mut self, command: &Command, dt_s: f64) -> Result<(), Error> {
        let before = self.momentum();
        self.advance(command, dt_s);
        let turned = self.bodies_momentum();
        self.read_states();
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

    fn update_clearance(&mut self) {
        self.truth.clearance_m = self.collisions.clearance(&self.physics);
    }
}
