//! Sage-Husa estimation of noise covariances with fading memory (Sage & Husa 1969; Liu et al. 2023, eq. 30).
//!
//! The printed estimator subtracts covariances (R ← (1−d) R + d (y yᵀ − H P⁻ Hᵀ)) and so loses positive definiteness.
//! Here the two forms that cannot:
//!
//! - [`SageHusa::observe_residual`], for R, from the residual *after* the update: R ← (1−d) R + d (ε εᵀ + H P⁺ Hᵀ),
//!   since E[ε εᵀ] = R − H P⁺ Hᵀ (Akhlaghi, Zhou & Huang 2017);
//! - [`SageHusa::observe_correction`], for Q, from the correction made: Q ← (1−d) Q + d diag(K y yᵀ Kᵀ).
//!
//! d = (1 − b)/(1 − bʲ) at j = J, J + 1, …, where J = 1/(1 − b): the start counts as one memory length. (In print j =
//! 1, 2, …: [`SageHusa::unlimited`].)
//!
//! Adapt one of R and Q, never both: one innovation cannot separate them. Each variance stays within limits around its
//! start, and at each step each off-diagonal number shrinks by a millionth: one huge residual would make R all but
//! singular.

use nalgebra::{SMatrix, SVector};

use crate::Real;
use crate::api::real::{pow, sqrt};
use crate::api::snapshot::{Archive, State, state};
use crate::filters::gaussian::{Correction, Gaussian, is_covariance};
use crate::filters::model::{Filter, Model};

/// A noise covariance that follows the data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SageHusa<const M: usize> {
    covariance: SMatrix<Real, M, M>,
    least: SVector<Real, M>,
    most: SVector<Real, M>,
    /// Fading factor b of d = (1 − b)/(1 − bᵏ⁺¹).
    fading: Real,
    /// bᵏ⁺¹.
    power: Real,
    limited: bool,
}

impl<const M: usize> SageHusa<M> {
    /// Starts at `start`, which counts as much as one memory length 1/(1 − `fading`) of samples; each variance stays
    /// between `limits[0]` and `limits[1]` times its start. `fading` in 0…1, both exclusive.
    pub fn new(start: SMatrix<Real, M, M>, fading: Real, limits: [Real; 2]) -> Self {
        let [low, high] = limits;
        let power = pow(fading, 1.0 / (1.0 - fading));
        let start_variance = start.diagonal();
        Self {
            covariance: start,
            least: start_variance * low,
            most: start_variance * high,
            fading,
            power,
            limited: false,
        }
    }

    /// As published: d = (1 − b)/(1 − bᵏ⁺¹) from k = 0, so that the first observation takes the place of the start, and
    /// no limits.
    pub(crate) fn unlimited(start: SMatrix<Real, M, M>, fading: Real) -> Self {
        Self {
            power: fading,
            ..Self::new(start, fading, [0.0, Real::INFINITY])
        }
    }

    /// The covariance to use now.
    #[inline]
    pub fn covariance(&self) -> &SMatrix<Real, M, M> {
        &self.covariance
    }

    /// Returns true if a limit acted at the last observation.
    pub fn limited(&self) -> bool {
        self.limited
    }

    /// For R: the residual ε = z − h(x⁺) and the corrected belief with the Jacobian `H` of the measurement.
    #[inline]
    pub fn observe_residual<const N: usize>(
        &mut self,
        residual: &SVector<Real, M>,
        H: &SMatrix<Real, M, N>,
        corrected: &Gaussian<N>,
    ) {
        self.blend(residual * residual.transpose() + H * corrected.P * H.transpose());
    }

    /// For Q: the correction K y that a measurement made.
    #[inline]
    pub fn observe_correction<const K: usize>(&mut self, correction: &Correction<K, M>) {
        let moved = correction.K * correction.y;
        self.blend(SMatrix::from_diagonal(&moved.component_mul(&moved)));
    }

    #[inline]
    fn blend(&mut self, observed: SMatrix<Real, M, M>) {
        let d = (1.0 - self.fading) / (1.0 - self.power);
        self.power *= self.fading;
        let next = self.covariance * (1.0 - d) + observed * d;
        if next.iter().all(|v| v.is_finite()) {
            self.covariance = (next + next.transpose()) * 0.5;
            self.limit();
        }
    }

    /// Shrinks rows and columns above the upper limit (D R D), keeps correlations off ±1 (one huge residual makes R all
    /// but singular), and adds to the diagonal below the lower limit: all three keep R positive definite.
    #[inline]
    fn limit(&mut self) {
        let variance = self.covariance.diagonal();
        let above = variance.iter().zip(&self.most).any(|(r, most)| r > most);
        if above {
            self.shrink();
        }
        if M > 1 {
            let diagonal = SMatrix::from_diagonal(&self.covariance.diagonal());
            self.covariance += (diagonal - self.covariance) * 1e-6;
        }
        let lack = self
            .covariance
            .diagonal()
            .zip_map(&self.least, |r, least| (least - r).max(0.0));
        self.covariance += SMatrix::from_diagonal(&lack);
        self.limited = above || lack.iter().any(|l| *l > 0.0);
    }

    /// D R D with variances cut to the upper limit. Rare, so out of the way of the usual step.
    #[cold]
    fn shrink(&mut self) {
        let shrink = self.covariance.diagonal().zip_map(&self.most, |r, most| {
            if r > most { sqrt(most / r) } else { 1.0 }
        });
        self.covariance
            .component_mul_assign(&(shrink * shrink.transpose()));
    }
}

state!(@[const M: usize] SageHusa<M> { covariance, power, limited; least, most, fading }
    where |this| is_covariance(&this.covariance) && (0.0..1.0).contains(&this.power));

/// Measurement noise R of a filter: known, or found from the residuals.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(clippy::large_enum_variant)]
pub enum Noise<const M: usize> {
    /// Constant noise.
    Known(SMatrix<Real, M, M>),
    /// Noise that follows the residuals.
    SageHusa(SageHusa<M>),
}

impl<const M: usize> Noise<M> {
    /// Starts at `R`: adapted as published ([`SageHusa::unlimited`]) with the `fading` factor, or known.
    pub fn published(R: SMatrix<Real, M, M>, fading: Option<Real>) -> Self {
        fading.map_or(Noise::Known(R), |fading| {
            Noise::SageHusa(SageHusa::unlimited(R, fading))
        })
    }

    /// R to use now.
    #[inline]
    pub fn R(&self) -> &SMatrix<Real, M, M> {
        match self {
            Noise::Known(R) => R,
            Noise::SageHusa(noise) => noise.covariance(),
        }
    }

    /// Returns true if a limit acted at the last observation.
    pub fn limited(&self) -> bool {
        matches!(self, Noise::SageHusa(noise) if noise.limited())
    }
}

impl<const M: usize> State for Noise<M> {
    fn visit(&mut self, archive: &mut Archive) {
        match self {
            Noise::Known(R) => R.visit(archive),
            Noise::SageHusa(noise) => noise.visit(archive),
        }
    }
}

/// A filter that adapts its measurement noise: over [`Ekf`](crate::filters::ekf::Ekf) the AEKF, over
/// [`Ukf`](crate::filters::ukf::Ukf) the AUKF, with [`Noise::Known`] the plain filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adaptive<T, const M: usize> {
    /// The filter.
    pub filter: T,
    /// Its measurement noise.
    pub noise: Noise<M>,
}

/// Extended Kalman filter with adapted measurement noise.
pub type Aekf<T, const N: usize, const M: usize> = Adaptive<crate::filters::ekf::Ekf<T, N>, M>;

/// Unscented Kalman filter with adapted measurement noise.
pub type Aukf<T, const N: usize, const M: usize> = Adaptive<crate::filters::ukf::Ukf<T, N>, M>;

impl<T, const M: usize> Adaptive<T, M> {
    /// Corrects the belief by a measurement with the noise found so far. `None`, and nothing changed, if the innovation
    /// covariance is not positive definite.
    #[inline]
    pub fn update<const N: usize>(&mut self, z: SVector<Real, M>) -> Option<Correction<M, N>>
    where
        T: Filter<N, M>,
    {
        self.filter.update(z, self.noise.R())
    }

    /// Adapts the noise to the residual ε = z − h(x⁺) after [`Adaptive::update`] by the same measurement.
    #[inline]
    pub(crate) fn adapt<const N: usize>(&mut self, z: SVector<Real, M>)
    where
        T: Filter<N, M>,
    {
        if let Noise::SageHusa(noise) = &mut self.noise {
            let (model, belief) = (self.filter.model(), self.filter.belief());
            noise.observe_residual(&(z - model.h(&belief.x)), &model.H(&belief.x), belief);
        }
    }
}

state!(@[T: State, const M: usize] Adaptive<T, M> { filter, noise; });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filters::ekf;
    use crate::testing::Random;
    use nalgebra::{Matrix1, matrix, vector};

    /// Runs a constant-velocity filter whose R starts `wrong` times the true variance; returns the R it ends with.
    fn adapted(true_r: Real, wrong: Real) -> Real {
        let (dt, q): (Real, Real) = (0.01, 1e-3);
        let (F, Q, H) = (
            matrix![1.0, dt; 0.0, 1.0],
            matrix![0.0, 0.0; 0.0, q * dt],
            matrix![1.0, 0.0],
        );
        let mut random = Random::new(11);
        let mut truth = vector![0.0, 1.0];
        let mut belief = Gaussian::<2>::independent(truth, vector![0.1, 0.1]);
        let mut noise = SageHusa::new(Matrix1::new(true_r * wrong), 0.998, [1e-3, 1e3]);
        for _ in 0..20_000 {
            truth = F * truth + vector![0.0, (q * dt).sqrt() * random.normal()];
            let z = vector![truth.x + true_r.sqrt() * random.normal()];
            let x_next = F * belief.x;
            ekf::predict(&mut belief, x_next, &F, &Q);
            let z_predicted = H * belief.x;
            ekf::update(&mut belief, z, z_predicted, &H, noise.covariance()).unwrap();
            noise.observe_residual(&(z - H * belief.x), &H, &belief);
            assert!(noise.covariance().x > 0.0);
        }
        noise.covariance().x
    }

    #[test]
    fn finds_the_measurement_noise_from_a_hundred_times_too_much_or_too_little() {
        for wrong in [0.01, 1.0, 100.0] {
            let ratio = adapted(0.01, wrong) / 0.01;
            assert!(
                (0.8..1.25).contains(&ratio),
                "started {wrong} times wrong, ended {ratio} times"
            );
        }
    }

    #[test]
    fn stays_positive_definite_and_within_limits_under_garbage() {
        let mut random = Random::new(12);
        let start = matrix![2.0, 0.5; 0.5, 1.0];
        let mut noise = SageHusa::new(start, 0.9, [0.1, 10.0]);
        for _ in 0..10_000 {
            let size = 10f64.powf(6.0 * random.normal());
            let residual = vector![size * random.normal(), size * random.normal()];
            let belief = Gaussian::<2>::independent(
                vector![0.0, 0.0],
                vector![random.uniform(), random.uniform()],
            );
            noise.observe_residual(&residual, &matrix![1.0, 0.0; 0.0, 1.0], &belief);
            let R = noise.covariance();
            assert!(R.cholesky().is_some(), "{R}");
            for (r, r0) in R.diagonal().iter().zip(start.diagonal().iter()) {
                assert!(*r <= r0 * 10.0 * 1.000_001 && *r >= r0 * 0.1 * 0.999_999);
            }
        }
        noise.observe_residual(
            &vector![Real::NAN, 0.0],
            &matrix![1.0, 0.0; 0.0, 1.0],
            &Gaussian {
                x: vector![0.0, 0.0],
                P: start,
            },
        );
        assert!(noise.covariance().iter().all(|v| v.is_finite()));
    }

    /// The estimator as Liu et al. print it (eq. 30; dimensions mended), on the in-model filter of [`adapted`]: how
    /// many of the first thousand steps leave R or a variance of Q not positive.
    fn printed_failures(seed: u64, b: Real) -> usize {
        let (dt, q, r): (Real, Real, Real) = (0.01, 1e-3, 0.01);
        let (F, H) = (matrix![1.0, dt; 0.0, 1.0], matrix![1.0, 0.0]);
        let (mut Q, mut R) = (matrix![1e-9, 0.0; 0.0, q * dt], Matrix1::new(r));
        let mut random = Random::new(seed);
        let mut truth = vector![0.0, 1.0];
        let mut belief = Gaussian::<2>::independent(truth, vector![0.1, 0.1]);
        let mut failures = 0;
        for k in 0..1000 {
            truth = F * truth + vector![0.0, (q * dt).sqrt() * random.normal()];
            let z = vector![truth.x + r.sqrt() * random.normal()];
            let carried = F * belief.P * F.transpose();
            let x_next = F * belief.x;
            ekf::predict(&mut belief, x_next, &F, &Q);
            let P_prior = belief.P;
            let z_predicted = H * belief.x;
            let Some(done) = ekf::update(&mut belief, z, z_predicted, &H, &R) else {
                return failures + 1000 - k; // the filter has broken down
            };
            let d = (1.0 - b) / (1.0 - b.powi(k as i32 + 1));
            let moved = done.K * done.y;
            Q = Q * (1.0 - d) + (moved * moved.transpose() + belief.P - carried) * d;
            R = R * (1.0 - d) + (done.y * done.y.transpose() - H * P_prior * H.transpose()) * d;
            failures += usize::from(R.x <= 0.0 || Q.m11 < 0.0 || Q.m22 < 0.0);
        }
        failures
    }

    #[test]
    fn the_printed_form_loses_positive_definiteness() {
        let broken = (0..40)
            .filter(|seed| printed_failures(*seed, 0.966) > 500)
            .count();
        assert!(broken > 20, "in only {broken} of 40 runs");
    }
}
