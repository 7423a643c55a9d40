//! Unscented Kalman filter: scaled unscented transform (Julier & Uhlmann 2004; Wan & van der Merwe 2000).
//!
//! Sigma points x and x ± √((n+φ) P), φ = α² (n + κ) − n; weights of the mean W₀ = φ/(n+φ), Wᵢ = 1/(2(n+φ)); the weight
//! of the centre in covariances is W₀ + 1 − α² + β. (Printed elsewhere with −β and with covariance weights in the mean
//! of the predicted measurement; both are slips: the weights of a mean must add to one.)
//!
//! The update is written as a statistical linearisation (Lefebvre, Bruyninckx & De Schutter 2002): H = P_zx P⁻¹ and
//! noise R + (P_zz − H P Hᵀ) give the same gain P_xz S⁻¹ and the same P⁺ = P − K S Kᵀ. With P = L Lᵀ, which the sigma
//! points need anyway, only H L occurs and P need not be solved for: [`Gaussian`] has the Joseph form of that.

use nalgebra::{SMatrix, SVector};

use crate::Real;
use crate::api::params::params;
use crate::api::real::sqrt;
use crate::api::snapshot::{Archive, State};
use crate::filters::gaussian::{Correction, Gaussian, cholesky};
use crate::filters::model::{Filter, Model};

/// The three constants of the scaled transform.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Distance of the points from the mean.
    pub alpha: Real,
    /// Knowledge of the distribution's tails; 2 for a Gaussian.
    pub beta: Real,
    /// Second distance; often 3 − n.
    pub kappa: Real,
}

params! {
    /// Sigma points of an unscented slope filter.
    SigmaParams {
        alpha ["-"] = 0.97, 1e-3 => 1.0, "Spread α of the sigma points.";
        beta ["-"] = 2.0, 0.0 => 10.0, "Tail constant β of the sigma points; 2 for a Gaussian.";
        kappa_ukf ["-"] = 1.0, -1.0 => 10.0, "Second spread κ of the sigma points; 3 − n = 1.";
    }
}

impl SigmaParams {
    /// The sigma points of these parameters.
    pub fn spread(&self) -> Spread {
        Spread {
            alpha: self.alpha,
            beta: self.beta,
            kappa: self.kappa_ukf,
        }
    }
}

/// The unscented Kalman filter of a model. The Jacobians of the model are not used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ukf<T, const N: usize> {
    /// The model.
    pub model: T,
    /// State and covariance.
    pub belief: Gaussian<N>,
    /// Constants of the sigma points.
    pub spread: Spread,
}

impl<T: Model<N, M>, const N: usize, const M: usize> Filter<N, M> for Ukf<T, N> {
    type Model = T;

    fn model(&self) -> &T {
        &self.model
    }

    fn belief(&self) -> &Gaussian<N> {
        &self.belief
    }

    fn belief_mut(&mut self) -> &mut Gaussian<N> {
        &mut self.belief
    }

    #[inline]
    fn predict(&mut self, u: &T::Input, dt: Real) -> Option<()> {
        let (model, Q) = (&self.model, self.model.Q(u, dt));
        predict(&mut self.belief, &self.spread, |x| model.f(x, u, dt), &Q)
    }

    #[inline]
    fn update(&mut self, z: SVector<Real, M>, R: &SMatrix<Real, M, M>) -> Option<Correction<M, N>> {
        let model = &self.model;
        update(&mut self.belief, &self.spread, z, |x| model.h(x), R)
    }
}

/// A snapshot holds the belief only; the model and the sigma points are built again.
impl<T, const N: usize> State for Ukf<T, N> {
    fn visit(&mut self, archive: &mut Archive) {
        self.belief.visit(archive);
    }
}

/// Image of a belief under a function: mean, and covariance in two parts.
struct Image<const M: usize, const N: usize> {
    mean: SVector<Real, M>,
    /// Central differences over the sigma points, scaled so that `linear` linearᵀ is the covariance of a linear
    /// function.
    linear: SMatrix<Real, M, N>,
    /// Covariance that the curvature of the function adds.
    bent: SMatrix<Real, M, M>,
}

impl Spread {
    /// n + φ.
    #[inline]
    fn scale(&self, n: usize) -> Real {
        self.alpha * self.alpha * (n as Real + self.kappa)
    }

    /// Weight of the centre in a mean, W₀.
    #[inline]
    fn centre_mean(&self, n: usize) -> Real {
        let scale = self.scale(n);
        (scale - n as Real) / scale
    }

    /// Weight of the centre in a covariance.
    #[inline]
    fn centre_covariance(&self, n: usize) -> Real {
        self.centre_mean(n) + 1.0 - self.alpha * self.alpha + self.beta
    }

    /// Image under `f` of the belief with mean `x` and covariance `L` Lᵀ.
    ///
    /// With a = (f₊ − f₋)/2 and b = (f₊ + f₋)/2 − mean of each pair of points, the sum over both of W (f − mean)(f −
    /// mean)ᵀ is (a aᵀ + b bᵀ)/(n+φ): what is linear and what is not come apart, and nothing is subtracted.
    #[inline(always)]
    fn image<const M: usize, const N: usize>(
        &self,
        x: &SVector<Real, N>,
        L: &SMatrix<Real, N, N>,
        f: impl Fn(&SVector<Real, N>) -> SVector<Real, M>,
    ) -> Image<M, N> {
        let scale = self.scale(N);
        let (root, share) = (sqrt(scale), 1.0 / scale);
        let centre = f(x);
        let (mut plus, mut minus) = (
            SMatrix::<Real, M, N>::zeros(),
            SMatrix::<Real, M, N>::zeros(),
        );
        for ((mut plus, mut minus), step) in plus
            .column_iter_mut()
            .zip(minus.column_iter_mut())
            .zip((L * root).column_iter())
        {
            plus.copy_from(&f(&(x + step)));
            minus.copy_from(&f(&(x - step)));
        }
        let linear = (plus - minus) * (0.5 / root);
        let mut middle = (plus + minus) * 0.5;
        let mean = centre * self.centre_mean(N) + middle.column_sum() * share;
        for mut b in middle.column_iter_mut() {
            b -= mean;
        }
        let centre = centre - mean;
        let bent = centre * centre.transpose() * self.centre_covariance(N)
            + middle * middle.transpose() * share;
        Image { mean, linear, bent }
    }
}

/// Carries a belief over one time step of `x_next` = f(x) with process noise `Q`. `None`, and nothing changed, if P is
/// not positive definite.
#[inline]
pub fn predict<const N: usize>(
    belief: &mut Gaussian<N>,
    spread: &Spread,
    f: impl Fn(&SVector<Real, N>) -> SVector<Real, N>,
    Q: &SMatrix<Real, N, N>,
) -> Option<()> {
    let next = spread.image(&belief.x, &cholesky(&belief.P)?, f);
    belief.x = next.mean;
    belief.P = next.linear * next.linear.transpose() + next.bent + Q;
    belief.symmetrise();
    Some(())
}

/// Corrects a belief by a measurement `z` = h(x) + noise of covariance `R`, with sigma points redrawn from the belief.
/// `None`, and nothing changed, if a covariance is not positive definite.
#[inline]
pub fn update<const M: usize, const N: usize>(
    belief: &mut Gaussian<N>,
    spread: &Spread,
    z: SVector<Real, M>,
    h: impl Fn(&SVector<Real, N>) -> SVector<Real, M>,
    R: &SMatrix<Real, M, M>,
) -> Option<Correction<M, N>> {
    let L = cholesky(&belief.P)?;
    let measured = spread.image(&belief.x, &L, h);
    // P_xz = L linearᵀ, so H = P_zx P⁻¹ makes H L = linear.
    belief.correct_factored(
        z - measured.mean,
        &L,
        &measured.linear,
        &(R + measured.bent),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filters::ekf;
    use crate::testing::{Random, chi_square_band};
    use nalgebra::{Matrix1, matrix, vector};
    use std::vec::Vec;

    const SPREAD: Spread = Spread {
        alpha: 0.97,
        beta: 2.0,
        kappa: 1.0,
    };

    #[test]
    fn weights_are_those_of_the_textbook() {
        // α = 0.97, κ = 1, n = 2: n + φ = 0.9409 · 3.
        assert!((SPREAD.scale(2) - 2.8227).abs() < 1e-12);
        let (mean, covariance) = (SPREAD.centre_mean(2), SPREAD.centre_covariance(2));
        assert!((mean - 0.8227 / 2.8227).abs() < 1e-12);
        assert!((covariance - mean - (1.0 - 0.9409 + 2.0)).abs() < 1e-12);
    }

    #[test]
    fn equals_the_kalman_filter_when_all_is_linear() {
        let F = matrix![1.0, 0.1, 0.0; -0.2, 0.9, 0.1; 0.0, 0.0, 1.0];
        let Q = matrix![0.01, 0.0, 0.0; 0.0, 0.02, 0.005; 0.0, 0.005, 0.03];
        let H = matrix![1.0, 0.0, 2.0; 0.0, 1.0, 0.0];
        let R = matrix![0.3, 0.1; 0.1, 0.2];
        let mut random = Random::new(31);
        let mut linear =
            Gaussian::<3>::independent(vector![1.0, -1.0, 0.5], vector![1.0, 2.0, 3.0]);
        let mut unscented = linear;
        for _ in 0..300 {
            let z = vector![random.normal(), random.normal()];
            let x_next = F * linear.x;
            ekf::predict(&mut linear, x_next, &F, &Q);
            let z_predicted = H * linear.x;
            let a = ekf::update(&mut linear, z, z_predicted, &H, &R).unwrap();
            predict(&mut unscented, &SPREAD, |x| F * x, &Q).unwrap();
            let b = update(&mut unscented, &SPREAD, z, |x| H * x, &R).unwrap();
            assert!(
                (linear.x - unscented.x).norm() < 1e-9 && (linear.P - unscented.P).norm() < 1e-9
            );
            assert!((a.nis - b.nis).abs() < 1e-8 && (a.K - b.K).norm() < 1e-9);
        }
    }

    #[test]
    fn mean_and_variance_of_a_square_are_exact() {
        // z = x², x ~ N(m, σ²): mean m² + σ², variance 4 m² σ² + 2 σ⁴. With n = 1, κ = 2, α = 1, β = 0 the transform is
        // exact (fourth moment matched); H from it is the slope of the regression of z on x, 2 m.
        let spread = Spread {
            alpha: 1.0,
            beta: 0.0,
            kappa: 2.0,
        };
        let (m, sd): (Real, Real) = (1.5, 0.7);
        let mut belief = Gaussian::<1>::independent(vector![m], vector![sd]);
        let R = 0.1;
        let correction = update(
            &mut belief,
            &spread,
            vector![3.0],
            |x| vector![x.x * x.x],
            &Matrix1::new(R),
        )
        .unwrap();
        let variance = 4.0 * m * m * sd * sd + 2.0 * sd.powi(4);
        assert!((correction.y.x - (3.0 - m * m - sd * sd)).abs() < 1e-12);
        assert!((correction.S.x - variance - R).abs() < 1e-12);
        let K = 2.0 * m * sd * sd / (variance + R);
        assert!((correction.K.x - K).abs() < 1e-12);
        assert!((belief.P.x - (sd * sd - K * K * (variance + R))).abs() < 1e-12);
    }

    #[test]
    fn error_of_an_in_model_filter_is_chi_square() {
        let (dt, q, r): (Real, Real, Real) = (0.02, 1e-3, 1e-3);
        let runs = 200;
        let nees: Vec<Real> = (0..runs)
            .map(|run| {
                let mut random = Random::new(4000 + run as u64);
                let f = |x: &nalgebra::Vector2<Real>| {
                    vector![x.x + dt * x.y, x.y - dt * 4.0 * x.x.sin()]
                };
                let mut belief = Gaussian::<2>::independent(vector![0.3, 0.0], vector![0.05, 0.05]);
                let mut truth = belief.x + vector![0.05 * random.normal(), 0.05 * random.normal()];
                for _ in 0..150 {
                    truth = f(&truth) + vector![0.0, (q * dt).sqrt() * random.normal()];
                    let z = truth.x.sin() + r.sqrt() * random.normal();
                    predict(&mut belief, &SPREAD, f, &matrix![0.0, 0.0; 0.0, q * dt]).unwrap();
                    update(
                        &mut belief,
                        &SPREAD,
                        vector![z],
                        |x| vector![x.x.sin()],
                        &Matrix1::new(r),
                    )
                    .unwrap();
                }
                let error = belief.x - truth;
                error.dot(&belief.P.cholesky().unwrap().solve(&error))
            })
            .collect();
        let mean = nees.iter().sum::<Real>() / (2 * runs) as Real;
        let (low, high) = chi_square_band(2 * runs);
        assert!((low..high).contains(&mean), "{mean} not in {low}…{high}");
    }

    #[test]
    fn a_singular_covariance_is_refused_and_changes_nothing() {
        let mut belief = Gaussian::<2> {
            x: vector![1.0, 2.0],
            P: matrix![1.0, 2.0; 2.0, 1.0],
        };
        let before = belief;
        assert!(predict(&mut belief, &SPREAD, |x| *x, &matrix![0.0, 0.0; 0.0, 0.0]).is_none());
        assert!(
            update(
                &mut belief,
                &SPREAD,
                vector![1.0],
                |x| vector![x.x],
                &Matrix1::new(1.0)
            )
            .is_none()
        );
        assert_eq!(belief, before);
    }
}
