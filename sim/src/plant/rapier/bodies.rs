//! The rigid bodies of a train, and the code that advances them: rapier while something could touch, [`FreeBody`]
//! otherwise.

use super::collisions::Collisions;
use super::convert::{self, mass_properties, pose_to_rapier, state_to_rapier, to_rapier};
use super::free_motion::FreeBody;
use crate::plant::PlantOptions;
use crate::plant::train::body_state::{BodyState, Wrench};
use crate::rail::Rail;
use crate::train::{Body, Train};
use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};
use rapier3d::math::Vector;
use rapier3d::prelude::{FrictionModel, PhysicsWorld, RigidBodyBuilder, RigidBodyHandle};

/// Bodies with their motion.
pub struct Bodies {
    states: Vec<BodyState>,
    free: Vec<FreeBody>,
    physics: PhysicsWorld,
    handles: Vec<RigidBodyHandle>,
    collisions: Collisions,
    gravity: f64,
    engine_always: bool,
}

impl Bodies {
    /// The bodies of a train with its front at `options.front_m`, at rest.
    pub fn new(train: &Train, rail: &Rail, options: &PlantOptions) -> Self {
        let mut physics = PhysicsWorld {
            gravity: Vector::new(0.0, 0.0, -options.gravity_mps2),
            ..Default::default()
        };
        let p = &mut physics.integration_parameters;
        p.num_solver_iterations = 1;
        p.max_ccd_substeps = 0;
        p.contact_recycling = false;
        p.friction_model = FrictionModel::Coulomb;

        let mut collisions = Collisions::new(&mut physics, rail, &options.obstacles);
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
                .gyroscopic_forces_enabled(false);
            let handle = physics.bodies.insert(body);
            collisions.add(&mut physics, handle, i, b, Some(i) == train.load);
            handles.push(handle);
        }
        // Masses and centres of mass read 0 until the first step.
        physics.integration_parameters.dt = 0.0;
        physics.step();
        Self {
            states: handles
                .iter()
                .map(|h| convert::state(&physics.bodies[*h]))
                .collect(),
            free: train.bodies.iter().map(FreeBody::new).collect(),
            physics,
            handles,
            collisions,
            gravity: options.gravity_mps2,
            engine_always: false,
        }
    }

    /// Motion of every body.
    pub fn states(&self) -> &[BodyState] {
        &self.states
    }

    /// Moves all bodies from the beginning of a step of `dt` (s) to its middle, where [`Bodies::step`] gets its
    /// wrenches.
    pub fn reach_middle(&mut self, dt: f64) {
        for (state, body) in self.states.iter_mut().zip(&self.free) {
            body.reach_middle(state, dt);
        }
    }

    /// Advance all bodies from the middle of a step of `dt` (s) from `t_s` to its end, under a wrench on each over the
    /// whole step, in the order of the bodies.
    pub fn step(&mut self, wrenches: &[Wrench], t_s: f64, dt: f64) {
        self.collisions
            .update_colliders(&mut self.physics, &self.states, t_s);
        let by_engine = self.collisions.enabled() || self.engine_always;
        if by_engine {
            self.step_in_engine(wrenches, dt);
        }
        for (i, (state, body)) in self.states.iter_mut().zip(&self.free).enumerate() {
            let (before, gained) = (state.with(-0.5), state.gained);
            if by_engine {
                *state = convert::state(&self.physics.bodies[self.handles[i]]);
                state.gained = gained;
            } else {
                [state.v, state.w] = before;
                body.push(state, &wrenches[i], self.gravity, dt);
            }
            body.reach_end(state, &before, dt, by_engine);
        }
    }

    fn step_in_engine(&mut self, wrenches: &[Wrench], dt: f64) {
        let bodies = self.handles.iter().zip(wrenches).zip(&self.states);
        for ((handle, wrench), state) in bodies {
            let body = &mut self.physics.bodies[*handle];
            state_to_rapier(state, body);
            body.reset_forces(false);
            body.reset_torques(false);
            body.add_force(to_rapier(&wrench.force), false);
            body.add_torque(to_rapier(&wrench.torque), false);
        }
        self.physics.integration_parameters.dt = dt;
        self.physics.step();
    }

    /// Give a body another velocity of its centre of mass (m/s) and angular velocity (rad/s), both in the world.
    pub fn set_velocity(&mut self, i: usize, v: Vector3<f64>, w: Vector3<f64>) {
        let state = &mut self.states[i];
        (state.v, state.w, state.gained) = (v, w, Default::default());
    }

    /// Give a body another mass, centre of mass and inertia; its origin and its velocities stay.
    pub fn set_mass(&mut self, i: usize, body: &Body) {
        self.free[i] = FreeBody::new(body);
        self.states[i].c = self.states[i].point(&body.com);
        self.physics.bodies[self.handles[i]]
            .set_additional_mass_properties(mass_properties(body), false);
    }

    /// True if a contact is possible, so that rapier's contact solver is on.
    pub fn contact_possible(&self) -> bool {
        self.collisions.enabled()
    }

    /// Least distance to obstacles and walls, m; infinite when there are none within reach.
    pub fn clearance(&self) -> f64 {
        self.collisions.clearance(&self.states)
    }

    /// Advances with rapier's whole pipeline in every step, also without a possible contact.
    pub fn set_engine_always(&mut self, on: bool) {
        self.engine_always = on;
    }
}
