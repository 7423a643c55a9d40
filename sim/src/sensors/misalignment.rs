//! Misalignment: the sensor's axes are turned against the mount's by a small rotation vector φ.
//!
//! A vector v in mount axes reads Rᵀ v in sensor axes, R = 1 + sin φ k× + (1 − cos φ) (k×)², k = φ/|φ| (Rodrigues
//! 1840).

use super::spec::InstrumentSpec;
use super::stream::Stream;
use crate::checked::{Finite, NonNegative};
use nalgebra::{Matrix3, Vector3};

/// The matrix Rᵀ of a run: known rotation plus one drawn once. `None` when the axes are aligned.
pub fn draw(spec: &InstrumentSpec, seed: u64, name: &str) -> Option<Matrix3<f64>> {
    let sd = spec.misalignment_sd_deg.map_or(0.0, NonNegative::get);
    let known = spec.misalignment_deg.unwrap_or_default().map(Finite::get);
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

    #[test]
    fn drawn_misalignments_have_their_spread_about_the_known_rotation() {
        let spec = InstrumentSpec {
            misalignment_deg: Some([1.0, 0.0, -2.0].map(Finite::new)),
            misalignment_sd_deg: Some(NonNegative::new(0.1)),
            ..InstrumentSpec::default()
        };
        let runs = 10_000;
        let mut squares = 0.0;
        for seed in 0..runs {
            let r = draw(&spec, seed, "gyro").unwrap();
            // Rᵀ = 1 − [φ]× to first order: φ_x = (m₂₃ − m₃₂)/2 and so on (right to φ³/6, 2e-5 of φ = 2°).
            let phi = [
                r[(1, 2)] - r[(2, 1)],
                r[(2, 0)] - r[(0, 2)],
                r[(0, 1)] - r[(1, 0)],
            ];
            for (x, known) in phi.iter().zip([1.0, 0.0, -2.0]) {
                squares += ((x / 2.0).to_degrees() - known).powi(2);
            }
        }
        let count = 3.0 * runs as f64;
        assert!((squares / count / 0.01 - 1.0).abs() < 5.0 * f64::sqrt(2.0 / count));
    }
}
