//! A covariance kept as its factors P = U D Uᵀ, U unit upper triangular, D diagonal (Bierman 1977, chapter V): the
//! square-root form without square roots.
//!
//! A covariance can lose its positive definiteness to rounding; U D Uᵀ cannot while D ≥ 0, and each step here only
//! multiplies the numbers of D by positive ones. It carries what a covariance of twice as many digits would.

use nalgebra::{SMatrix, SVector};

use crate::Real;
use crate::api::real::sqrt;
use crate::api::snapshot::state;
use crate::filters::gaussian::finite;

/// Factors of a covariance of `N` numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Factors<const N: usize> {
    /// Unit upper triangular.
    pub(crate) U: SMatrix<Real, N, N>,
    /// Diagonal, not negative.
    pub(crate) D: SVector<Real, N>,
}

impl<const N: usize> Factors<N> {
    /// Factors of `P`; variances that rounding has made negative become 0.
    pub fn of(P: &SMatrix<Real, N, N>) -> Self {
        let mut rest = *P;
        let mut factors = Self {
            U: SMatrix::identity(),
            D: SVector::zeros(),
        };
        for j in (0..N).rev() {
            let d = rest.column(j).get(j).copied().unwrap_or(0.0);
            if d > 0.0 {
                let u = rest.column(j) / d;
                rest -= u * u.transpose() * d;
                factors
                    .U
                    .column_mut(j)
                    .rows_range_mut(..j)
                    .copy_from(&u.rows_range(..j));
                factors.D.rows_range_mut(j..=j).fill(d);
            }
        }
        factors
    }

    /// U D Uᵀ.
    pub fn covariance(&self) -> SMatrix<Real, N, N> {
        let mut P = self.U * SMatrix::from_diagonal(&self.D) * self.U.transpose();
        P.fill_upper_triangle_with_lower_triangle();
        P
    }

    /// hᵀ P h, never negative.
    pub fn variance_along(&self, h: &SVector<Real, N>) -> Real {
        let f = self.U.tr_mul(h);
        self.D.dot(&f.component_mul(&f))
    }

    /// P ← P · `by`.
    pub fn scale(&mut self, by: Real) {
        self.D *= by;
    }

    /// Takes in a measurement with Jacobian row `h` and noise variance `r` > 0; the gain K = P h/(r + hᵀ P h).
    pub fn update_scalar(&mut self, h: &SVector<Real, N>, r: Real) -> SVector<Real, N> {
        let mut gain = SVector::zeros();
        let mut S = r;
        for (mut u, d) in self.U.column_iter_mut().zip(self.D.iter_mut()) {
            let f = u.dot(h);
            let v = *d * f;
            let (before, old) = (S, u.clone_owned());
            S += f * v;
            u -= gain * (f / before);
            gain += old * v;
            *d *= before / S;
        }
        gain / S
    }

    /// Limits each variance to `most`, keeping every correlation. Returns true if a limit acted.
    pub fn limit_variance(&mut self, most: &SVector<Real, N>) -> bool {
        let variance = self.U.component_mul(&self.U) * self.D;
        if variance.iter().zip(most).all(|(now, most)| now <= most) {
            return false;
        }
        let shrink = variance.zip_map(
            most,
            |now, most| {
                if now > most { sqrt(most / now) } else { 1.0 }
            },
        );
        if shrink.iter().any(|s| *s <= 0.0) {
            // A variance may not be anything: nothing else can be kept of it.
            *self = Self::of(&SMatrix::from_diagonal(&variance.zip_map(most, Real::min)));
            return true;
        }
        // S U D Uᵀ S = (S U S⁻¹) S² D (S U S⁻¹)ᵀ
        let back = shrink.map(|s| 1.0 / s);
        self.U.component_mul_assign(&(shrink * back.transpose()));
        self.U.fill_diagonal(1.0);
        self.D.component_mul_assign(&shrink.component_mul(&shrink));
        true
    }

    /// Returns true if every number of the factors is finite.
    pub fn is_finite(&self) -> bool {
        finite(&self.U) && finite(&self.D)
    }
}

state!(@[const N: usize] Factors<N> { U, D; } where |this| this.D.iter().all(|d| *d >= 0.0)
    && this.U.lower_triangle() == SMatrix::<Real, N, N>::identity());

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filters::gaussian::Gaussian;
    use crate::testing::Random;
    use nalgebra::{Matrix3, Vector3, matrix, vector};

    fn some_covariance() -> Matrix3<Real> {
        matrix![2.0, 0.3, 0.1; 0.3, 1.0, -0.2; 0.1, -0.2, 0.5]
    }

    fn close(a: &Matrix3<Real>, b: &Matrix3<Real>) -> bool {
        (a - b).norm() < 1e4 * Real::EPSILON * b.norm()
    }

    #[test]
    fn factors_multiply_to_the_covariance() {
        let P = some_covariance();
        let factors = Factors::of(&P);
        assert!(close(&factors.covariance(), &P));
        let h = vector![1.0, -2.0, 0.5];
        assert!((factors.variance_along(&h) - h.dot(&(P * h))).abs() < 1e4 * Real::EPSILON);
        let singular = Factors::of(&Matrix3::from_diagonal(&vector![1.0, 0.0, 2.0]));
        assert_eq!(singular.D, vector![1.0, 0.0, 2.0]);
    }

    #[test]
    fn a_measurement_does_what_the_joseph_form_does() {
        let mut random = Random::new(21);
        let mut plain = Gaussian {
            x: Vector3::zeros(),
            P: some_covariance(),
        };
        let mut factors = Factors::of(&plain.P);
        for _ in 0..200 {
            let h = Vector3::from_fn(|_, _| random.normal());
            let gain = factors.update_scalar(&h, 0.3);
            let done = plain.correct_scalar(1.0, &h, 0.3).unwrap();
            assert!((gain - done.K).norm() < 1e4 * Real::EPSILON);
            assert!(close(&factors.covariance(), &plain.P));
            factors.scale(1.02);
            plain.P *= 1.02;
        }
    }

    #[test]
    fn variance_limit_keeps_correlations() {
        let mut plain = Gaussian {
            x: Vector3::zeros(),
            P: some_covariance(),
        };
        let mut factors = Factors::of(&plain.P);
        let most = vector![1.0, 5.0, 0.1];
        assert!(factors.limit_variance(&most) && plain.limit_variance(&most));
        assert!(close(&factors.covariance(), &plain.P));
        assert!(!factors.limit_variance(&vector![2.0, 2.0, 2.0]));
    }
}
