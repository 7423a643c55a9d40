//! Mass, centre of mass and inertia tensor of rigid parts, and their sum by the parallel-axis theorem.

use nalgebra::{Isometry3, Matrix3, Vector3};

/// Mass properties of a rigid part, in a frame of the caller's choice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassProperties {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Centre of mass, m.
    pub com: Vector3<f64>,
    /// Inertia tensor about the centre of mass, axes of the frame, kg·m².
    pub inertia: Matrix3<f64>,
}

impl MassProperties {
    /// Nothing.
    pub fn zero() -> Self {
        Self {
            mass_kg: 0.0,
            com: Vector3::zeros(),
            inertia: Matrix3::zeros(),
        }
    }

    /// Returns the same part in frame A, where `pose` is the pose of the part's frame in A.
    pub fn seen_from(&self, pose: &Isometry3<f64>) -> Self {
        let r = pose.rotation.to_rotation_matrix();
        Self {
            mass_kg: self.mass_kg,
            com: (pose * nalgebra::Point3::from(self.com)).coords,
            inertia: r.matrix() * self.inertia * r.matrix().transpose(),
        }
    }

    /// Both parts as one, J = Σ Jᵢ + mᵢ (dᵢ·dᵢ 1 − dᵢ dᵢᵀ), dᵢ from the common centre of mass (Steiner).
    pub fn plus(&self, other: &Self) -> Self {
        let mass_kg = self.mass_kg + other.mass_kg;
        if mass_kg <= 0.0 {
            return Self::zero();
        }
        let com = (self.com * self.mass_kg + other.com * other.mass_kg) / mass_kg;
        let about_com = |p: &Self| p.inertia + steiner(p.mass_kg, &(p.com - com));
        Self {
            mass_kg,
            com,
            inertia: about_com(self) + about_com(other),
        }
    }

    /// Returns the same shape with another mass.
    pub fn scaled_to(&self, mass_kg: f64) -> Self {
        Self {
            mass_kg,
            com: self.com,
            inertia: self.inertia * (mass_kg / self.mass_kg),
        }
    }

    /// Reason why no solid body can have these properties; `None` if a body can.
    ///
    /// A body's second moments Σ = ∫ r rᵀ dm = ½ tr(J) 1 − J are never negative; in principal axes that is the
    /// triangle inequality J₁ + J₂ ≥ J₃.
    pub fn flaw(&self) -> Option<String> {
        let j = &self.inertia;
        let size = j.trace();
        if !(self.mass_kg.is_finite() && self.mass_kg > 0.0) {
            return Some(format!("mass {} kg is not above zero", self.mass_kg));
        }
        if !j.iter().chain(self.com.iter()).all(|x| x.is_finite()) {
            return Some("a number is not finite".into());
        }
        if j.cholesky().is_none() {
            return Some("inertia is not positive definite".into());
        }
        let slack = Matrix3::identity() * (size * 1e-9);
        let second_moments = Matrix3::identity() * (0.5 * size) - j;
        if (second_moments + slack).cholesky().is_none() {
            return Some(
                "the inertia violates the triangle inequality: one principal moment is larger than the sum of the other two"
                    .into(),
            );
        }
        None
    }
}

fn steiner(mass_kg: f64, d: &Vector3<f64>) -> Matrix3<f64> {
    (Matrix3::identity() * d.norm_squared() - d * d.transpose()) * mass_kg
}

#[allow(clippy::unwrap_used)]
#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, UnitQuaternion};

    /// Full edge lengths.
    fn cuboid(mass_kg: f64, at: [f64; 3], [a, b, c]: [f64; 3]) -> MassProperties {
        MassProperties {
            mass_kg,
            com: at.into(),
            inertia: Matrix3::from_diagonal(&Vector3::new(
                b * b + c * c,
                a * a + c * c,
                a * a + b * b,
            )) * (mass_kg / 12.0),
        }
    }

    fn close(a: &MassProperties, b: &MassProperties) {
        assert!((a.mass_kg - b.mass_kg).abs() < 1e-12 * b.mass_kg);
        assert!((a.com - b.com).norm() < 1e-12, "{} {}", a.com, b.com);
        assert!(
            (a.inertia - b.inertia).norm() < 1e-12 * b.inertia.norm(),
            "{} {}",
            a.inertia,
            b.inertia
        );
    }

    #[test]
    fn two_point_like_parts_match_the_sum_worked_by_hand() {
        // 2 kg at x = 0 and 4 kg at (3, 0, 1.5), each with J = diag(0.1, 0.2, 0.25).
        // Common centre: (2, 0, 1). d₁ = (−2, 0, −1), d₂ = (1, 0, 0.5).
        // Jxx = 0.2 + 2·1 + 4·0.25 = 3.2;  Jyy = 0.4 + 2·5 + 4·1.25 = 15.4;  Jzz = 0.5 + 2·4 + 4·1 = 12.5;
        // Jxz = −(2·(−2)(−1) + 4·1·0.5) = −6.
        let j = Matrix3::from_diagonal(&Vector3::new(0.1, 0.2, 0.25));
        let part = |mass_kg, com| MassProperties {
            mass_kg,
            com,
            inertia: j,
        };
        let sum = part(2.0, Vector3::zeros()).plus(&part(4.0, Vector3::new(3.0, 0.0, 1.5)));
        close(
            &sum,
            &MassProperties {
                mass_kg: 6.0,
                com: Vector3::new(2.0, 0.0, 1.0),
                inertia: Matrix3::new(3.2, 0.0, -6.0, 0.0, 15.4, 0.0, -6.0, 0.0, 12.5),
            },
        );
    }

    #[test]
    fn a_body_cut_in_pieces_keeps_its_properties() {
        let whole = cuboid(8.0, [0.3, -0.2, 0.1], [2.0, 1.0, 0.5]);
        let mut pieces = MassProperties::zero();
        for ix in 0..2 {
            for iy in 0..2 {
                let at = [
                    0.3 - 0.5 + f64::from(ix),
                    -0.2 - 0.25 + 0.5 * f64::from(iy),
                    0.1,
                ];
                pieces = pieces.plus(&cuboid(2.0, at, [1.0, 0.5, 0.5]));
            }
        }
        close(&pieces, &whole);
    }

    #[test]
    fn sum_then_move_is_move_then_sum() {
        let pose = Isometry3::from_parts(
            Translation3::new(1.0, -2.0, 0.4),
            UnitQuaternion::from_euler_angles(0.3, -0.8, 2.0),
        );
        let a = cuboid(3.0, [0.1, 0.2, 0.3], [0.4, 0.5, 0.6]);
        let b = cuboid(5.0, [-1.0, 0.7, 0.0], [1.4, 0.1, 0.2]);
        close(
            &a.plus(&b).seen_from(&pose),
            &a.seen_from(&pose).plus(&b.seen_from(&pose)),
        );
    }

    #[test]
    fn impossible_bodies_are_named() {
        let with = |mass_kg, d: [f64; 3]| MassProperties {
            mass_kg,
            com: Vector3::zeros(),
            inertia: Matrix3::from_diagonal(&d.into()),
        };
        assert!(
            with(1.0, [1.0, 1.0, 2.0]).flaw().is_none(),
            "a flat plate is a limit case"
        );
        assert!(
            with(0.0, [1.0; 3])
                .flaw()
                .is_some_and(|f| f.contains("mass"))
        );
        assert!(
            with(-1.0, [1.0; 3])
                .flaw()
                .is_some_and(|f| f.contains("mass"))
        );
        assert!(
            with(1.0, [1.0, 1.0, -1.0])
                .flaw()
                .is_some_and(|f| f.contains("definite"))
        );
        assert!(
            with(1.0, [1.0, 1.0, 2.1])
                .flaw()
                .is_some_and(|f| f.contains("triangle"))
        );
        assert!(with(1.0, [f64::NAN, 1.0, 1.0]).flaw().is_some());
    }
}
