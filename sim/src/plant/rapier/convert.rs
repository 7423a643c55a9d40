//! Converts between our types (nalgebra) and rapier's (glam).

use crate::plant::train::body_state::BodyState;
use crate::train::{Body, Geometry};
use nalgebra::{Isometry3, Matrix3, Quaternion, UnitQuaternion, Vector3};
use rapier3d::math::{Matrix, Pose, Rotation, Vector};
use rapier3d::prelude::{MassProperties, RigidBody, SharedShape};

/// A vector for rapier.
pub fn to_rapier(v: &Vector3<f64>) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

/// A vector from rapier.
pub fn from_rapier(v: Vector) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}

/// A pose for rapier.
pub fn pose_to_rapier(iso: &Isometry3<f64>) -> Pose {
    let q = iso.rotation.quaternion();
    Pose {
        translation: to_rapier(&iso.translation.vector),
        rotation: Rotation::from_xyzw(q.i, q.j, q.k, q.w),
    }
}

/// Mass, centre of mass and inertia of a body.
pub fn mass_properties(b: &Body) -> MassProperties {
    let m = &b.inertia;
    let columns = [m.column(0), m.column(1), m.column(2)].map(|c| Vector::new(c[0], c[1], c[2]));
    MassProperties::with_inertia_matrix(
        to_rapier(&b.com),
        b.mass_kg,
        Matrix::from_cols(columns[0], columns[1], columns[2]),
    )
}

/// Makes a shape for collisions, and its pose in our frame.
pub fn shared_shape(g: &Geometry) -> Option<(SharedShape, Pose)> {
    Some(match g {
        Geometry::Box(size) => (
            SharedShape::cuboid(size.x / 2.0, size.y / 2.0, size.z / 2.0),
            Pose::IDENTITY,
        ),
        // parry's cylinders stand along y, ours along z
        Geometry::Cylinder(r, l) => (
            SharedShape::cylinder(l / 2.0, *r),
            Pose {
                translation: Vector::ZERO,
                rotation: Rotation::from_axis_angle(Vector::X, std::f64::consts::FRAC_PI_2),
            },
        ),
        Geometry::Sphere(r) => (SharedShape::ball(*r), Pose::IDENTITY),
        Geometry::Mesh { vertices, .. } => {
            let points: Vec<Vector> = vertices
                .iter()
                .map(|v| Vector::new(v[0], v[1], v[2]))
                .collect();
            (SharedShape::convex_hull(&points)?, Pose::IDENTITY)
        }
    })
}

/// Sets a body to the place of `s` in the middle of a step and to its velocities before the step.
pub fn state_to_rapier(s: &BodyState, body: &mut RigidBody) {
    body.set_position(pose(s), false);
    let [v, w] = s.with(-0.5);
    body.set_linvel(to_rapier(&v), false);
    body.set_angvel(to_rapier(&w), false);
}

/// Pose of a body for rapier.
pub fn pose(s: &BodyState) -> Pose {
    Pose {
        translation: to_rapier(&s.p),
        rotation: Rotation::from_xyzw(s.q.i, s.q.j, s.q.k, s.q.w),
    }
}

/// The motion of a body at a steady speed.
pub fn state(b: &RigidBody) -> BodyState {
    let pose = b.position();
    let q = pose.rotation;
    let m = Matrix::from_quat(q);
    BodyState {
        p: from_rapier(pose.translation),
        q: UnitQuaternion::new_unchecked(Quaternion::new(q.w, q.x, q.y, q.z)),
        r: Matrix3::from_columns(&[
            from_rapier(m.x_axis),
            from_rapier(m.y_axis),
            from_rapier(m.z_axis),
        ]),
        c: from_rapier(b.center_of_mass()),
        v: from_rapier(b.linvel()),
        w: from_rapier(b.angvel()),
        gained: [Vector3::zeros(); 2],
    }
}
