//! Strong tracking filter (Zhou & Frank 1996): a fading factor λ ≥ 1 on the predicted covariance keeps innovations of
//! different instants orthogonal, so that the filter follows a jump it did not foresee.
//!
//! - V ← (ρ V + y yᵀ)/(1 + ρ): what the innovation covariance is
//! - λ = tr(V − H Q Hᵀ − β R) / tr(H F P Fᵀ Hᵀ), at least 1: what P must be multiplied by to explain it
//!
//! The traces are taken after whitening by S = H F P Fᵀ Hᵀ + H Q Hᵀ + R, so that speeds and accelerations in one
//! measurement count alike; with one measurement that changes nothing. λ has an upper limit, and the caller chooses the
//! states that fade: a state known well need not pay for a jump of another (multiple fading).

use nalgebra::{SMatrix, SVector};

use crate::Real;
use crate::api::real::within;
use crate::api::snapshot::state;
use crate::filters::ekf::Ekf;
use crate::filters::gaussian::Gaussian;
use crate::filters::model::Model;

/// Finds the fading factor from innovations of `M` measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrongTracking<const M: usize> {
    /// Memory ρ of the innovation covariance, 0…1.
    memory: Real,
    /// Weakening factor β ≥ 1: the larger, the smoother.
    weakening: Real,
    /// Largest λ.
    most: Real,
    V: Option<SMatrix<Real, M, M>>,
}

impl<const M: usize> StrongTracking<M> {
    /// Builds the fading of strong tracking from memory ρ, weakening β and the largest λ.
    pub fn new(memory: Real, weakening: Real, most: Real) -> Self {
        Self {
            memory,
            weakening,
            most,
            V: None,
        }
    }

    /// λ for the innovation `y`: `carried` = H F P Fᵀ Hᵀ, `process` = H Q Hᵀ, `R` measurement noise.
    #[inline]
    pub fn fading(
        &mut self,
        y: &SVector<Real, M>,
        carried: &SMatrix<Real, M, M>,
        process: &SMatrix<Real, M, M>,
        R: &SMatrix<Real, M, M>,
    ) -> Real {
        let square = y * y.transpose();
        let V = self
            .V
            .map_or(square, |V| (V * self.memory + square) / (1.0 + self.memory));
        let Some(S) = (carried + process + R).cholesky() else {
            return 1.0;
        };
        let excess = S.solve(&(V - process - R * self.weakening)).trace();
        let explained = S.solve(carried).trace();
        self.V = Some(V)
            .filter(|V| V.iter().all(|v| v.is_finite()))
            .or(self.V);
        let lambda = excess / explained;
        if explained > 1e-12 && lambda.is_finite() {
            within(lambda, 1.0, self.most)
        } else {
            1.0
        }
    }
}

impl<const M: usize> StrongTracking<M> {
    /// The published filter's prediction: P⁻ = λ F P Fᵀ + Q, with λ from the measurement `z` to come. Returns λ.
    #[inline]
    pub fn predict<T: Model<N, M>, const N: usize>(
        &mut self,
        ekf: &mut Ekf<T, N>,
        u: &T::Input,
        dt: Real,
        z: SVector<Real, M>,
        R: &SMatrix<Real, M, M>,
    ) -> Real {
        let ahead = ekf.preview(z, u, dt);
        let lambda = self.fading(&ahead.y, &ahead.carried, &ahead.process, R);
        ekf.belief.P *= lambda;
        ekf.predict(u, dt);
        lambda
    }
}

/// Multiplies the variance of each state by its factor ≥ 1, *before* the belief is carried to the instant of the
/// measurement. What is added is independent of the other states: a jump owes nothing to old errors. (Stretching the
/// covariances with the variance, or fading after the prediction, claims a tie between the states that the model does
/// not have; the gain then overshoots.)
#[inline]
pub fn fade<const N: usize>(belief: &mut Gaussian<N>, factors: &SVector<Real, N>) {
    let added = belief
        .P
        .diagonal()
        .zip_map(factors, |variance, factor| (factor - 1.0) * variance);
    belief.P += SMatrix::from_diagonal(&added);
}

/// Smoothing of the normalised innovations, per sample; the level, and the number of samples below it, that end an
/// alarm.
const ALARM_MEMORY: Real = 0.95;
const CALM: Real = 1.3;
const CALM_SAMPLES: u32 = 20;
/// Correlation of successive innovations above which these are not noise.
const TIED: Real = 0.5;

/// Detects a jump of the state, with hysteresis: strong tracking that is always on follows noise.
///
/// Innovations too large for the assumed noise can mean a jump or a noisier sensor. After a jump they keep to one side;
/// noise changes sides. So the alarm rings when yᵀ S⁻¹ y is too large *and* successive innovations are tied: the very
/// orthogonality that strong tracking is there to restore.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alarm<const M: usize> {
    level: Real,
    /// Smoothed yᵀ S⁻¹ y / M and yᵀ S⁻¹ y′ / M, y′ the innovation before.
    size: Real,
    tie: Real,
    last: Option<SVector<Real, M>>,
    calm: u32,
    active: bool,
}

impl<const M: usize> Alarm<M> {
    /// Makes an alarm that starts when the smoothed normalised innovation squared, for each measurement 1 on average,
    /// passes `level`.
    pub fn new(level: Real) -> Self {
        Self {
            level,
            size: 1.0,
            tie: 0.0,
            last: None,
            calm: 0,
            active: false,
        }
    }

    /// Takes one innovation with its covariance. Returns true while the alarm is on.
    #[inline]
    pub fn active(&mut self, y: &SVector<Real, M>, S: &SMatrix<Real, M, M>) -> bool {
        let Some(factor) = S.cholesky() else {
            return self.active;
        };
        // One wild sample alone moves the mean by less than half the level.
        let most = 10.0 * self.level;
        let whitened = factor.solve(y);
        let size = (y.dot(&whitened) / M as Real).min(most);
        let tie = self
            .last
            .map_or(0.0, |last| last.dot(&whitened) / M as Real);
        if !size.is_finite() || !tie.is_finite() {
            return self.active;
        }
        self.last = Some(*y);
        self.size += (1.0 - ALARM_MEMORY) * (size - self.size);
        self.tie += (1.0 - ALARM_MEMORY) * (within(tie, -most, most) - self.tie);
        self.calm = if self.size < CALM {
            self.calm.saturating_add(1)
        } else {
            0
        };
        if self.size > self.level && self.tie > TIED * self.size {
            self.active = true;
        } else if self.calm >= CALM_SAMPLES || self.tie < 0.0 {
            self.active = false;
        }
        self.active
    }
}

state!(@[const M: usize] StrongTracking<M> { V; memory, weakening, most });
state!(@[const M: usize] Alarm<M> { size, tie, last, calm, active; level });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filters::ekf;
    use crate::testing::Random;
    use nalgebra::{Matrix1, matrix, vector};

    #[test]
    fn the_faded_covariance_explains_the_innovations_exactly() {
        // Orthogonality: with β = 1 and λ inside its limits, λ H F P Fᵀ Hᵀ + H Q Hᵀ + R = V.
        let mut tracking = StrongTracking::<1>::new(0.95, 1.0, 1e9);
        let mut random = Random::new(41);
        let (mut V, mut acted) = (None, 0);
        for _ in 0..1000 {
            let y: Real = 3.0 * random.normal();
            let (carried, process, R) = (random.uniform(), random.uniform(), random.uniform());
            let expected = V.map_or(y * y, |V: Real| (0.95 * V + y * y) / 1.95);
            V = Some(expected);
            let lambda = tracking.fading(
                &vector![y],
                &Matrix1::new(carried),
                &Matrix1::new(process),
                &Matrix1::new(R),
            );
            assert!(lambda >= 1.0);
            if lambda > 1.0 {
                acted += 1;
                assert!(
                    (lambda * carried + process + R - expected).abs() < 1e-9 * expected.max(1.0)
                );
            } else {
                assert!(expected <= carried + process + R + 1e-9);
            }
        }
        assert!(acted > 500);
    }

    #[test]
    fn units_of_the_measurements_do_not_matter() {
        let mut random = Random::new(42);
        let (mut a, mut b) = (
            StrongTracking::<2>::new(0.95, 2.0, 50.0),
            StrongTracking::<2>::new(0.95, 2.0, 50.0),
        );
        let U = matrix![1000.0, 0.0; 0.0, 1.0];
        let (carried, process, R) = (
            matrix![0.5, 0.1; 0.1, 0.3],
            matrix![0.1, 0.0; 0.0, 0.1],
            matrix![0.2, 0.0; 0.0, 0.4],
        );
        for _ in 0..100 {
            let y = vector![2.0 * random.normal(), 2.0 * random.normal()];
            let here = a.fading(&y, &carried, &process, &R);
            let there = b.fading(
                &(U * y),
                &(U * carried * U),
                &(U * process * U),
                &(U * R * U),
            );
            assert!((here - there).abs() < 1e-6 * here);
        }
    }

    #[test]
    fn follows_a_jump_long_before_the_kalman_filter_and_fades_only_what_it_is_told() {
        let (F, H) = (matrix![1.0, 0.01; 0.0, 1.0], matrix![1.0, 0.0]);
        let (Q, R) = (matrix![1e-8, 0.0; 0.0, 1e-8], Matrix1::new(1e-4));
        let run = |strong: bool| {
            let mut random = Random::new(43);
            let mut tracking = StrongTracking::<1>::new(0.95, 2.0, 50.0);
            let mut belief = Gaussian::<2>::independent(vector![0.0, 0.0], vector![0.1, 0.1]);
            let mut position = 0.0;
            let mut late = 0;
            for k in 0..2000 {
                let speed = if k < 1000 { 0.0 } else { 1.0 };
                position += 0.01 * speed;
                let z = position + 0.01 * random.normal();
                let carried = Gaussian {
                    x: F * belief.x,
                    P: F * belief.P * F.transpose(),
                };
                let y = vector![z] - H * carried.x;
                let lambda = tracking.fading(
                    &y,
                    &(H * carried.P * H.transpose()),
                    &(H * Q * H.transpose()),
                    &R,
                );
                belief.x = carried.x;
                if strong {
                    let before = belief.P.m11;
                    fade(&mut belief, &vector![1.0, lambda]);
                    assert_eq!(belief.P.m11, before);
                }
                belief.P = F * belief.P * F.transpose() + Q;
                let z_predicted = H * belief.x;
                ekf::update(&mut belief, vector![z], z_predicted, &H, &R).unwrap();
                assert!(belief.P.cholesky().is_some());
                late += usize::from(k >= 1000 && (belief.x.y - 1.0).abs() > 0.2);
            }
            late
        };
        let (strong, plain) = (run(true), run(false));
        assert!(3 * strong < plain, "{strong} steps late against {plain}");
    }

    #[test]
    fn a_state_that_explains_nothing_does_not_fade() {
        let mut tracking = StrongTracking::<1>::new(0.95, 1.0, 50.0);
        let zero = Matrix1::new(0.0);
        assert_eq!(
            tracking.fading(&vector![100.0], &zero, &zero, &Matrix1::new(1.0)),
            1.0
        );
        assert_eq!(
            tracking.fading(
                &vector![Real::NAN],
                &Matrix1::new(1.0),
                &zero,
                &Matrix1::new(1.0)
            ),
            1.0
        );
        assert!(
            tracking.fading(&vector![5.0], &Matrix1::new(1.0), &zero, &Matrix1::new(1.0)) > 1.0
        );
    }

    #[test]
    fn the_alarm_ignores_noise_of_any_size_and_single_outliers_rings_on_a_shift_and_stops() {
        let mut alarm = Alarm::<1>::new(3.0);
        let mut random = Random::new(44);
        let mut rings = |mean: Real, sd: Real, count: usize| {
            (0..count)
                .filter(|_| alarm.active(&vector![mean + sd * random.normal()], &Matrix1::new(1.0)))
                .count()
        };
        assert!(rings(0.0, 1.0, 20_000) < 20);
        assert!(rings(0.0, 5.0, 20_000) < 2_000);
        rings(0.0, 1.0, 500);
        assert_eq!(rings(1e3, 1.0, 1), 0);
        assert!(rings(4.0, 1.0, 50) > 30);
        rings(0.0, 1.0, 500);
        assert_eq!(rings(0.0, 1.0, 100), 0);
    }
}
