//! Motion of one rigid body, in the world frame.
//!
//! A step takes the bodies to its middle, changes their velocities by the forces there, and takes them to its end. The
//! forces see the places and velocities that the middle has if the velocities change as in the last step
//! (`implicit.rs`).

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// Motion of one rigid body.
#[derive(Clone, Copy, Debug)]
pub struct BodyState {
    /// Origin of the body frame, m.
    pub p: Vector3<f64>,
    /// Rotation from the body frame to the world.
    pub(crate) q: UnitQuaternion<f64>,
    /// Rotation as a matrix.
    pub r: Matrix3<f64>,
    /// Centre of mass, m.
    pub c: Vector3<f64>,
    /// Velocity of the centre of mass, m/s.
    pub v: Vector3<f64>,
    /// Angular velocity, rad/s.
    pub w: Vector3<f64>,
    /// Changes of both velocities in the last step.
    pub(crate) gained: [Vector3<f64>; 2],
}

impl BodyState {
    /// World position of a point of the body frame, m.
    pub fn point(&self, local: &Vector3<f64>) -> Vector3<f64> {
        self.p + self.r * local
    }

    /// Velocity of the body at a world point, m/s.
    pub fn velocity(&self, at: &Vector3<f64>) -> Vector3<f64> {
        self.v + self.w.cross(&(at - self.c))
    }

    /// Change of the velocity of a world point, m/s, as both velocities change by `by`.
    pub(crate) fn change(&self, by: &[Vector3<f64>; 2], at: &Vector3<f64>) -> Vector3<f64> {
        by[0] + by[1].cross(&(at - self.c))
    }

    /// Both velocities with a share of the changes of the last step.
    pub(crate) fn with(&self, share: f64) -> [Vector3<f64>; 2] {
        let [v, w] = self.gained;
        [self.v + v * share, self.w + w * share]
    }
}

/// Force and torque about the centre of mass, in the world, N and N·m.
#[derive(Clone, Copy, Debug)]
pub struct Wrench {
    /// Force, N.
    pub(crate) force: Vector3<f64>,
    /// Torque about the centre of mass, N·m.
    pub(crate) torque: Vector3<f64>,
}

impl Wrench {
    /// Nothing.
    pub const ZERO: Self = Self {
        force: Vector3::new(0.0, 0.0, 0.0),
        torque: Vector3::new(0.0, 0.0, 0.0),
    };

    /// Add a force at a world point of the body.
    pub(crate) fn add(&mut self, body: &BodyState, force: &Vector3<f64>, at: &Vector3<f64>) {
        self.force += force;
        self.torque += (at - body.c).cross(force);
    }
}
