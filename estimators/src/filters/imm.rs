//! Interacting multiple models (Blom & Bar-Shalom 1988), with fixed or time-varying transition probabilities.
//!
//! One cycle: [`Imm::mix`] the beliefs, predict and correct each by its own model, [`Imm::weigh`] the models by their
//! likelihoods, [`Imm::combined`].
//!
//! Time-varying transitions (Guo et al. 2024, eq. 36–38): π_ij ← π_ij λ_j / Σ_l π_il λ_l with λ_j = exp(μ_j(k) −
//! μ_j(k−1)). The product telescopes, so π_ij(k) = π_ij(0) exp(μ_j(k) − μ_j(0)) / Σ_l π_il(0) exp(μ_l(k) − μ_l(0)): no
//! state, no drift, and plain to see that it only leans mildly towards the likelier model.

use nalgebra::{SMatrix, SVector};

use crate::Real;
use crate::api::real::exp;
use crate::api::snapshot::state;
use crate::filters::gaussian::Gaussian;

/// Least probability of a model, so that its probability can rise again.
const LEAST: Real = 1e-4;

/// `K` beliefs about the same `N` states, each under its own model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Imm<const N: usize, const K: usize> {
    /// The beliefs, one for each model.
    pub beliefs: [Gaussian<N>; K],
    /// Probability of each model.
    probability: SVector<Real, K>,
    start: SVector<Real, K>,
    /// Row i: probabilities of going from model i to each model, at the start.
    transition: SMatrix<Real, K, K>,
    time_varying: bool,
}

impl<const N: usize, const K: usize> Imm<N, K> {
    /// All models equally likely and of the same belief; `stay` is the probability of staying in a model from step to
    /// step.
    pub fn new(belief: Gaussian<N>, stay: Real, time_varying: bool) -> Self {
        let leave = if K > 1 {
            (1.0 - stay) / (K - 1) as Real
        } else {
            0.0
        };
        let transition = SMatrix::from_fn(|i, j| {
            if i == j {
                1.0 - leave * (K - 1) as Real
            } else {
                leave
            }
        });
        Self::of(belief, transition, time_varying)
    }

    fn of(belief: Gaussian<N>, transition: SMatrix<Real, K, K>, time_varying: bool) -> Self {
        let start = SVector::repeat(1.0 / K as Real);
        Self {
            beliefs: [belief; K],
            probability: start,
            start,
            transition,
            time_varying,
        }
    }

    /// Transition probabilities in force, row i = from model i.
    #[inline]
    pub fn transition(&self) -> SMatrix<Real, K, K> {
        if !self.time_varying {
            return self.transition;
        }
        let lean = (self.probability - self.start).map(exp);
        let mut leaned = self.transition * SMatrix::from_diagonal(&lean);
        for mut row in leaned.row_iter_mut() {
            let sum = row.sum();
            row /= sum;
        }
        leaned
    }

    /// Interaction: each model starts from the mixture it is likely to have come from (eq. 21–24).
    #[inline]
    pub fn mix(&mut self) {
        let transition = self.transition();
        let predicted = transition.transpose() * self.probability;
        let mut mixed = self.beliefs;
        for ((belief, from), c) in mixed
            .iter_mut()
            .zip(transition.column_iter())
            .zip(predicted.iter())
        {
            let weights = self.probability.component_mul(&from) / *c;
            *belief = mixture(&self.beliefs, &weights);
        }
        self.beliefs = mixed;
        self.probability = predicted;
    }

    /// Bayes: the probability of each model after its correction had the given ln likelihood (eq. 32–33). Call after
    /// [`Imm::mix`] in each cycle with a measurement.
    #[inline]
    pub fn weigh(&mut self, log_likelihoods: &SVector<Real, K>) {
        let largest = log_likelihoods
            .iter()
            .copied()
            .fold(Real::NEG_INFINITY, Real::max);
        let weights = log_likelihoods
            .map(|l| exp(l - largest))
            .component_mul(&self.probability);
        let sum = weights.sum();
        if sum > 0.0 && sum.is_finite() {
            let floored = (weights / sum).map(|w| w.max(LEAST));
            self.probability = floored / floored.sum();
        }
    }

    /// Probability of each model.
    #[inline]
    pub fn probability(&self) -> &SVector<Real, K> {
        &self.probability
    }

    /// The belief over all models (eq. 34–35).
    #[inline]
    pub fn combined(&self) -> Gaussian<N> {
        mixture(&self.beliefs, &self.probability)
    }
}

/// Gaussian with the mean and covariance of a mixture.
#[inline]
fn mixture<const N: usize, const K: usize>(
    beliefs: &[Gaussian<N>; K],
    weights: &SVector<Real, K>,
) -> Gaussian<N> {
    let mut x = SVector::zeros();
    for (belief, weight) in beliefs.iter().zip(weights.iter()) {
        x += belief.x * *weight;
    }
    let mut P = SMatrix::zeros();
    for (belief, weight) in beliefs.iter().zip(weights.iter()) {
        let away = belief.x - x;
        P += (belief.P + away * away.transpose()) * *weight;
    }
    Gaussian { x, P }
}

state!(@[const N: usize, const K: usize] Imm<N, K> { beliefs, probability; start, transition, time_varying }
    where |this| this.probability.iter().all(|p| (0.0..=1.0).contains(p)));

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;
    use nalgebra::{Matrix2, vector};

    /// One cycle of a random walk under `K` process noises.
    fn cycle<const K: usize>(imm: &mut Imm<1, K>, q: [Real; K], r: Real, z: Real) {
        imm.mix();
        let mut logs = SVector::<Real, K>::zeros();
        for ((belief, q), log) in imm.beliefs.iter_mut().zip(q).zip(logs.iter_mut()) {
            belief.P.x += q;
            *log = belief
                .correct_scalar(z - belief.x.x, &vector![1.0], r)
                .unwrap()
                .log_likelihood;
        }
        imm.weigh(&logs);
    }

    #[test]
    fn equals_the_two_model_filter_written_out_by_hand() {
        let (q, r, stay) = ([0.01, 1.0], 0.5, 0.95);
        let mut random = Random::new(51);
        let mut imm = Imm::<1, 2>::new(
            Gaussian::independent(vector![0.0], vector![1.0]),
            stay,
            false,
        );
        let (mut x, mut p, mut mu) = ([0.0, 0.0], [1.0, 1.0], [0.5, 0.5]);
        for _ in 0..300 {
            let z: Real = 2.0 * random.normal();
            cycle(&mut imm, q, r, z);

            let pi = [[stay, 1.0 - stay], [1.0 - stay, stay]];
            let (mut nx, mut np, mut weight) = ([0.0; 2], [0.0; 2], [0.0; 2]);
            for j in 0..2 {
                let c = pi[0][j] * mu[0] + pi[1][j] * mu[1];
                let (a, b) = (pi[0][j] * mu[0] / c, pi[1][j] * mu[1] / c);
                let m = a * x[0] + b * x[1];
                let v = a * (p[0] + (x[0] - m).powi(2)) + b * (p[1] + (x[1] - m).powi(2)) + q[j];
                let s: Real = v + r;
                nx[j] = m + v / s * (z - m);
                np[j] = v - v * v / s;
                weight[j] = c * (-0.5 * (z - m).powi(2) / s).exp()
                    / (2.0 * core::f64::consts::PI * s).sqrt();
            }
            let sum = weight[0] + weight[1];
            let floored = [(weight[0] / sum).max(1e-4), (weight[1] / sum).max(1e-4)];
            mu = [
                floored[0] / (floored[0] + floored[1]),
                floored[1] / (floored[0] + floored[1]),
            ];
            (x, p) = (nx, np);
            for j in 0..2 {
                assert!(
                    (imm.beliefs[j].x.x - x[j]).abs() < 1e-9
                        && (imm.beliefs[j].P.x - p[j]).abs() < 1e-9
                );
                assert!((imm.probability[j] - mu[j]).abs() < 1e-9);
            }
            let mean = mu[0] * x[0] + mu[1] * x[1];
            assert!((imm.combined().x.x - mean).abs() < 1e-9);
        }
    }

    #[test]
    fn closed_form_of_the_transitions_equals_the_recursion() {
        let mut random = Random::new(52);
        let mut imm = Imm::<1, 2>::new(
            Gaussian::independent(vector![0.0], vector![1.0]),
            0.95,
            true,
        );
        let mut recursive: Matrix2<Real> = imm.transition;
        let mut before = imm.probability;
        for _ in 0..500 {
            let p = random.uniform();
            imm.probability = vector![p, 1.0 - p];
            let lambda = (imm.probability - before).map(Real::exp);
            for i in 0..2 {
                let sum = recursive[(i, 0)] * lambda.x + recursive[(i, 1)] * lambda.y;
                recursive[(i, 0)] *= lambda.x / sum;
                recursive[(i, 1)] *= lambda.y / sum;
            }
            before = imm.probability;
            assert!((imm.transition() - recursive).norm() < 1e-9);
        }
        imm.probability = vector![1.0, 0.0];
        let pi = imm.transition();
        assert!((pi.m12 - 0.0190).abs() < 1e-4 && (pi.m21 - 0.1252).abs() < 1e-4);
    }

    #[test]
    fn one_model_is_the_kalman_filter_and_equal_models_change_nothing() {
        let mut random = Random::new(53);
        let prior = Gaussian::independent(vector![0.0], vector![1.0]);
        let (mut one, mut three, mut alone) = (
            Imm::<1, 1>::new(prior, 0.9, true),
            Imm::<1, 3>::new(prior, 0.9, true),
            prior,
        );
        for _ in 0..200 {
            let z = random.normal();
            cycle(&mut one, [0.1], 0.5, z);
            cycle(&mut three, [0.1; 3], 0.5, z);
            alone.P.x += 0.1;
            let y = z - alone.x.x;
            alone.correct_scalar(y, &vector![1.0], 0.5).unwrap();
            for combined in [one.combined(), three.combined()] {
                assert!(
                    (combined.x - alone.x).norm() < 1e-12 && (combined.P - alone.P).norm() < 1e-12
                );
            }
            assert!((three.probability.sum() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn finds_the_model_that_made_the_data() {
        for time_varying in [false, true] {
            let mut random = Random::new(54);
            let mut imm = Imm::<1, 2>::new(
                Gaussian::independent(vector![0.0], vector![1.0]),
                0.98,
                time_varying,
            );
            let (mut truth, mut right) = (0.0, 0);
            for k in 0..4000 {
                let busy = (k / 500) % 2 == 1;
                truth += if busy { 1.0 } else { 0.01 } * random.normal();
                cycle(&mut imm, [1e-4, 1.0], 0.01, truth + 0.1 * random.normal());
                right += usize::from((imm.probability.y > 0.5) == busy);
            }
            assert!(right > 3600, "{right} of 4000");
        }
    }

    #[test]
    fn without_measurements_the_probabilities_are_those_of_the_chain() {
        let belief = Gaussian::<1>::independent(vector![0.0], vector![1.0]);
        let pi = Matrix2::new(0.9, 0.1, 0.3, 0.7);
        let mut imm = Imm::of(belief, pi, false);
        // They go to the eigenvector of πᵀ: 3 to 1.
        (0..200).for_each(|_| imm.mix());
        assert!((imm.probability().x - 0.75).abs() < 1e-12);
        let by_stay = Imm::<1, 2>::new(belief, 0.9, true);
        let same = Matrix2::new(0.9, 0.1, 0.1, 0.9);
        assert!((by_stay.transition() - same).norm() < 1e-15);
    }

    #[test]
    fn hopeless_likelihoods_keep_the_probabilities() {
        let mut imm =
            Imm::<1, 2>::new(Gaussian::independent(vector![0.0], vector![1.0]), 0.9, true);
        imm.weigh(&vector![-1e6, -1e6 - 1.0]);
        assert!(imm.probability.x > 0.7 && imm.probability.y > 0.2);
        let before = imm.probability;
        imm.weigh(&vector![Real::NAN, 0.0]);
        assert_eq!(imm.probability, before);
    }
}
