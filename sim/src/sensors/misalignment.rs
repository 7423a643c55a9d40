//! Misalignment: the sensor's axes are turned against the mount's by a small rotation vector φ.
//!
//! A vector v in mount axes reads Rᵀ v in sensor axes, R = 1 + sin φ [k]× + (1 − cos φ) [k]×², k = φ/|φ| (Rodrigues 1840).

use super::sheet::InertialSensor;
use super::stream::Stream;
use nalgebra::{Matrix3, Vector3};

/// The matrix Rᵀ of a run: known rotation plus one drawn once. `None` when the axes are aligned.
pub fn draw(sensor: &InertialSensor, seed: u64, name: &str) -> Option<Matrix3<f64>> {
    let sd = sensor.misalignment_sd_deg.map_or(0.0, |s| s.get());
    let known = sensor
        .misalignment_deg
        .map_or([0.0; 3], |v| v.map(|x| x.get()));
    let mut stream = Stream::new(seed, &format!("{name}/misalignment"));
    let phi = Vector3::from(known.map(|x| (x + sd * stream.normal()).to_radians()));
    (phi != Vector3::zeros()).then(|| rotation(&phi).transpose())
}

/// R of a rotation vector, rad.
fn rotation(phi: &Vector3<f64>) -> Matrix3<f64> {
    let angle = phi.norm();
    if angle == 0.0 {
        return Matrix3::identity();
    }
    let k = (phi / angle).cross_matrix();
    Matrix3::identity() + k * libm::sin(angle) + k * k * (1.0 - libm::cos(angle))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nose of the sensor turned up by 2° (rotation about y, left, by −2°): at rest it reads g·sin 2° forward.
    #[test]
    fn a_pitched_sensor_feels_gravity_forward() {
        let r = rotation(&Vector3::new(0.0, f64::to_radians(-2.0), 0.0)).transpose();
        let f = r * Vector3::new(0.0, 0.0, 9.81);
        assert!(
            (f.x - 9.81 * f64::to_radians(2.0).sin()).abs() < 1e-12,
            "{f}"
        );
        assert!((f.norm() - 9.81).abs() < 1e-12);
    }

    #[test]
    fn rotations_keep_lengths_and_the_axis() {
        let phi = Vector3::new(0.02, -0.1, 0.3);
        let r = rotation(&phi);
        assert!((r.transpose() * r - Matrix3::identity()).norm() < 1e-14);
        assert!((r * phi - phi).norm() < 1e-15);
        assert!((r.determinant() - 1.0).abs() < 1e-14);
        assert!(((r.trace() - 1.0) / 2.0 - phi.norm().cos()).abs() < 1e-14);
    }
}
