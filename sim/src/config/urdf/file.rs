//! A URDF file while it is read: errors that point into it, and poses.

use crate::error::Error;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use std::path::Path;

/// A file being read; makes errors that point into it.
pub(super) struct File<'a> {
    pub path: &'a Path,
    pub text: String,
}

impl File<'_> {
    /// An error at `<tag name="name"`.
    pub fn fault(&self, tag: &str, name: &str, message: impl Into<String>, help: &str) -> Error {
        let at = (!tag.is_empty())
            .then(|| self.text.find(&format!("<{tag} name=\"{name}\"")))
            .flatten()
            .and_then(|i| self.text.get(..i));
        let place = at.map(|before| {
            let start = before.rfind('\n').map_or(0, |n| n + 1);
            (before.matches('\n').count() + 1, before.len() - start + 1)
        });
        let key = match tag.is_empty() {
            true => String::new(),
            false => format!("{tag} `{name}`"),
        };
        Error::input(self.path, place, key, message, help)
    }

    pub fn pose(&self, tag: &str, name: &str, p: &urdf_rs::Pose) -> Result<Isometry3<f64>, Error> {
        let numbers = p.xyz.iter().chain(p.rpy.iter());
        if numbers.clone().any(|x| !x.is_finite() || x.abs() > 1e6) {
            return Err(self.fault(
                tag,
                name,
                "an origin holds a number that is not finite or beyond 1e6",
                "metres and radians",
            ));
        }
        Ok(Isometry3::from_parts(
            Translation3::from(p.xyz.0),
            rotation(p.rpy.0),
        ))
    }
}

/// Rotation of fixed-axis roll, pitch, yaw: R = Rz(yaw) Ry(pitch) Rx(roll).
pub(super) fn rotation([roll, pitch, yaw]: [f64; 3]) -> UnitQuaternion<f64> {
    let half = |angle: f64, axis: Vector3<f64>| {
        let (s, c) = libm::sincos(0.5 * angle);
        Quaternion::from_parts(c, axis * s)
    };
    UnitQuaternion::new_normalize(
        half(yaw, Vector3::z()) * half(pitch, Vector3::y()) * half(roll, Vector3::x()),
    )
}
