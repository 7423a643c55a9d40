//! Unscented Kalman filter: scaled unscented transform (Julier & Uhlmann 2004; Wan & van der Merwe 2000).
//!
//! Sigma points x and x ± √((n+φ) P), φ = α² (n + κ) − n; weights of the mean W₀ = φ/(n+φ), Wᵢ = 1/(2(n+φ)); the weight of the
//! centre in covariances is W₀ + 1 − α² + β. (Printed elsewhere with −β and with covariance weights in the mean of the predicted
//! measurement; both are slips: the weights of a mean must add to one.)
//!
//! The update is written as a statistical linearisation (Lefebvre, Bruyninckx & De Schutter 2002): H = P_zx P⁻¹ and noise
//! R + (P_zz − H P Hᵀ) give the same gain P_xz S⁻¹ and the same P⁺ = P − K S Kᵀ, and the Joseph form of [`Gaussian`] serves here too.

use nalgebra::{SMatrix, SVector};

use crate::{
    Real,
    gaussian::{Correction, Gaussian, cholesky, solve_transposed},
    real::sqrt,
};

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

/// An image of the sigma points: centre, points on the plus side and on the minus side.
struct Image<const M: usize, const N: usize> {
    mean: SVector<Real, M>,
    centre: SVector<Real, M>,
    plus: SMatrix<Real, M, N>,
    minus: SMatrix<Real, M, N>,
}

/// Weights: centre in a mean, centre in a covariance, any other point.
struct Weights {
    centre_mean: Real,
    centre_covariance: Real,
    other: Real,
}

impl Spread {
    /// n + φ.
    #[inline]
    fn scale(&self, n: usize) -> Real {
        self.alpha * self.alpha * (n as Real + self.kappa)
    }

    #[inline]
    fn weights(&self, n: usize) -> Weights {
        let scale = self.scale(n);
        let centre_mean = (scale - n as Real) / scale;
        let centre_covariance = centre_mean + 1.0 - self.alpha * self.alpha + self.beta;
        Weights {
            centre_mean,
            centre_covariance,
            other: 0.5 / scale,
        }
    }

    /// √((n+φ) P), a column for each direction.
    #[inline]
    fn reach<const N: usize>(&self, belief: &Gaussian<N>) -> Option<SMatrix<Real, N, N>> {
        Some(cholesky(&belief.P)? * sqrt(self.scale(N)))
    }
}

#[inline]
fn image<const M: usize, const N: usize>(
    x: &SVector<Real, N>,
    reach: &SMatrix<Real, N, N>,
    weights: &Weights,
    f: impl Fn(&SVector<Real, N>) -> SVector<Real, M>,
) -> Image<M, N> {
    let centre = f(x);
    let (mut plus, mut minus) = (
        SMatrix::<Real, M, N>::zeros(),
        SMatrix::<Real, M, N>::zeros(),
    );
    for ((mut plus, mut minus), step) in plus
        .column_iter_mut()
        .zip(minus.column_iter_mut())
        .zip(reach.column_iter())
    {
        plus.copy_from(&f(&(x + step)));
        minus.copy_from(&f(&(x - step)));
    }
    let mean =
        centre * weights.centre_mean + (plus.column_sum() + minus.column_sum()) * weights.other;
    Image {
        mean,
        centre,
        plus,
        minus,
    }
}

/// What the points, a column each, differ by from their mean.
#[inline]
fn away<const M: usize, const N: usize>(
    points: &SMatrix<Real, M, N>,
    mean: &SVector<Real, M>,
) -> SMatrix<Real, M, N> {
    let mut away = *points;
    for mut point in away.column_iter_mut() {
        point -= mean;
    }
    away
}

/// Σ W (a − ā)(b − b̄)ᵀ over the points of two images.
#[inline]
fn covariance<const A: usize, const B: usize, const N: usize>(
    a: &Image<A, N>,
    b: &Image<B, N>,
    weights: &Weights,
) -> SMatrix<Real, A, B> {
    let centre = (a.centre - a.mean) * (b.centre - b.mean).transpose();
    let plus = away(&a.plus, &a.mean) * away(&b.plus, &b.mean).transpose();
    let minus = away(&a.minus, &a.mean) * away(&b.minus, &b.mean).transpose();
    centre * weights.centre_covariance + (plus + minus) * weights.other
}

/// Carries a belief over one time step of `x_next` = f(x) with process noise `Q`. `None`, and nothing changed, if P is not
/// positive definite.
#[inline]
pub fn predict<const N: usize>(
    belief: &mut Gaussian<N>,
    spread: &Spread,
    f: impl Fn(&SVector<Real, N>) -> SVector<Real, N>,
    Q: &SMatrix<Real, N, N>,
) -> Option<()> {
    let weights = spread.weights(N);
    let next = image(&belief.x, &spread.reach(belief)?, &weights, f);
    belief.x = next.mean;
    belief.P = covariance(&next, &next, &weights) + Q;
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
    let weights = spread.weights(N);
    let reach = spread.reach(belief)?;
    let measured = image(&belief.x, &reach, &weights, h);
    // With P_xz = W reach (plus − minus)ᵀ and P = reach reachᵀ/(n+φ), P_zx P⁻¹ is a central difference over the reach.
    let slopes = (measured.plus - measured.minus) * 0.5;
    let H = solve_transposed(&reach, &slopes.transpose())?.transpose();
    let beyond_linear = covariance(&measured, &measured, &weights) - H * belief.P * H.transpose();
    belief.correct(z - measured.mean, &H, &(R + beyond_linear))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        ekf,
        testing::{Random, chi_square_band},
    };
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
        let weights = SPREAD.weights(2);
        assert!((SPREAD.scale(2) - 2.8227).abs() < 1e-12);
        assert!((weights.centre_mean + 4.0 * weights.other - 1.0).abs() < 1e-12);
        assert!(
            (weights.centre_covariance - weights.centre_mean - (1.0 - 0.9409 + 2.0)).abs() < 1e-12
        );
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
        // z = x², x ~ N(m, σ²): mean m² + σ², variance 4 m² σ² + 2 σ⁴. With n = 1, κ = 2, α = 1, β = 0 the transform is exact
        // (fourth moment matched); H from it is the slope of the regression of z on x, 2 m.
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
