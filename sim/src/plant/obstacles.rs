//! Obstacles: boxes fixed in the world beside the rail.

use crate::rail::RailFrame;
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};

/// A box fixed in the world.
#[derive(Clone, Copy, Debug)]
pub struct ObstacleBox {
    /// Pose of its middle.
    pub pose: Isometry3<f64>,
    /// Full edge lengths, m.
    pub size: Vector3<f64>,
}

impl ObstacleBox {
    /// A box from one frame of the rail to the next, `size` = width and height (m) around the rail's line.
    pub(crate) fn between(a: &RailFrame, b: &RailFrame, size: [f64; 2]) -> Self {
        let turn = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[a.t, a.l, a.u]));
        let middle = (a.p + b.p) / 2.0;
        let length = (b.p - a.p).norm();
        Self {
            pose: Isometry3::from_parts(middle.into(), UnitQuaternion::from_rotation_matrix(&turn)),
            size: Vector3::new(length, size[0], size[1]),
        }
    }
}
