//! Recursive least squares: one recursion, several ways to forget.
//!
//! y(k) = hᵀ(k) χ + e(k). A step first forgets, then corrects.
//!
//! λ comes from a policy ([`Forgetting`]).
//!
//! P ← P/λ followed by a correction with noise r is the usual recursion K = P h / (λ r + hᵀ P h), P ← (P − K hᵀ P)/λ
//! (Liu et al. 2023, eq. 20–22, with the a-priori residual of this step), so the Joseph form of [`Gaussian`] serves here too.
//!
//! In square-root form ([`Rls::in_square_root_form`]) the same recursion carries the factors of P ([`Factors`]); its result is the same
//! to rounding, and P stays positive definite where rounding would end that: in single precision (`Real` = f32), long runs, poor
//! excitation. A regression with one parameter needs no such form.
//!
//! Beside it run two averages of the normalised residual n = e/√(r + hᵀ P h), P before forgetting, over m = min(50, k + 1) at
//! update k = 1, 2, …: s² ← s² + (min(n², 25 s²) − s²)/m from s² = 1, the [`Rls::spread`] that makes σ of dynamic forgetting
//! free of units; and c of n times the n before it (held within ±25 s²), of which [`Rls::correlation_factor`] tells.

use nalgebra::{SMatrix, SVector};

use crate::{
    Real,
    forgetting::{Forgetting, SPREAD_KNOWN},
    gaussian::Gaussian,
    real::{sqrt, within},
    snapshot::{Archive, State, state, visit_built},
    ud::Factors,
};

/// Where a parameter that should be about 1 is stopped.
const BEYOND_REASON: Real = 1e3;

/// Number of updates the running deviation of the residual looks back on.
const SPREAD_MEMORY: Real = 50.0;

/// What an update did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outcome {
    /// A-priori residual y − hᵀχ, in the unit of y.
    pub residual: Real,
    /// The same divided by the standard deviation predicted for it.
    pub normalised: Real,
    /// Forgetting factor used (the smallest, where there are several).
    pub lambda: Real,
    /// Whether a variance was cut back to its prior (wind-up limit).
    pub limited: bool,
}

/// Recursive least squares for `N` parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rls<const N: usize> {
    /// Parameters χ and their covariance, for residuals of the variance given to [`Rls::update`].
    pub belief: Gaussian<N>,
    /// Factors of `belief.P`, in square-root form.
    factors: Option<Factors<N>>,
    prior: SVector<Real, N>,
    policy: Forgetting<N>,
    /// Running variance of the normalised residual: 1 when the noise variance given is right.
    spread: Real,
    /// Running product of successive normalised residuals.
    tie: Real,
    last: Real,
    updates: u32,
}

impl<const N: usize> Rls<N> {
    /// Starts from a belief about the parameters; no variance will ever exceed that of the start (wind-up limit).
    pub fn new(prior: Gaussian<N>, policy: Forgetting<N>) -> Self {
        Self {
            belief: prior,
            factors: None,
            prior: prior.P.diagonal(),
            policy,
            spread: 1.0,
            tie: 0.0,
            last: 0.0,
            updates: 0,
        }
    }

    /// The same, carrying the factors of P if `wanted`.
    pub fn in_square_root_form(mut self, wanted: bool) -> Self {
        self.factors = wanted.then(|| Factors::of(&self.belief.P));
        self
    }

    /// One sample: `y` = `h`ᵀχ + noise of variance `r`. `remember` suspends forgetting (use it while `h` carries no
    /// information, so that P cannot wind up). `None`, and nothing changed, if the numbers allow no update.
    #[inline]
    pub fn update(
        &mut self,
        y: Real,
        h: &SVector<Real, N>,
        r: Real,
        remember: bool,
    ) -> Option<Outcome> {
        let residual = y - h.dot(&self.belief.x);
        let carried = match &self.factors {
            Some(factors) => factors.variance_along(h),
            None => h.dot(&(self.belief.P * h)),
        };
        let predicted = sqrt(r + carried);
        let normalised = residual / predicted;
        if !normalised.is_finite() {
            return None;
        }

        let lambda = if remember {
            1.0
        } else if matches!(self.policy, Forgetting::Dynamic { .. }) {
            self.policy.lambda(normalised / self.spread(), self.updates)
        } else {
            self.policy.lambda(normalised, self.updates)
        };
        let (mut belief, mut factors) = (self.belief, self.factors);
        let limited = match (self.policy, &mut factors) {
            (Forgetting::Multiple(lambdas), factors) => {
                let lambdas = if remember {
                    SVector::repeat(1.0)
                } else {
                    SVector::from(lambdas)
                };
                update_multiple(&mut belief, residual, h, r, &lambdas)?;
                let limited = belief.limit_variance(&self.prior);
                *factors = factors.map(|_| Factors::of(&belief.P));
                limited
            }
            (_, Some(factors)) => {
                (r > 0.0).then_some(())?;
                factors.scale(1.0 / lambda);
                belief.x += factors.absorb(h, r) * residual;
                let limited = factors.limit_variance(&self.prior);
                belief.P = factors.covariance();
                limited
            }
            (_, None) => {
                belief.P *= 1.0 / lambda;
                belief.absorb(residual, h, r)?;
                belief.limit_variance(&self.prior)
            }
        };
        if !belief.is_finite() || factors.is_some_and(|factors| !factors.is_finite()) {
            return None;
        }
        self.factors = factors;
        self.belief = belief;
        self.note(normalised);
        Some(Outcome {
            residual,
            normalised,
            lambda,
            limited,
        })
    }

    /// Running statistics of the normalised residual.
    #[inline]
    fn note(&mut self, normalised: Real) {
        // A residual beyond five deviations is an event, not noise: it may move the running deviation, not own it.
        let limit = 25.0 * self.spread.max(1e-12);
        let memory = SPREAD_MEMORY.min(self.updates as Real + 2.0);
        self.tie += (within(normalised * self.last, -limit, limit) - self.tie) / memory;
        self.last = normalised;
        self.spread += ((normalised * normalised).min(limit) - self.spread) / memory;
        self.updates = self.updates.saturating_add(1);
    }

    /// Standard deviation of the residual divided by the one predicted for it: 1 when the noise variance given is right.
    #[inline]
    pub fn spread(&self) -> Real {
        sqrt(self.spread.max(1e-12))
    }

    /// What the variance of slowly varying parameters must be multiplied by because successive residuals are not independent:
    /// (1 + ρ)/(1 − ρ), ρ their correlation; 1 while they are, or while too few are known.
    pub fn correlation_factor(&self) -> Real {
        if self.updates < SPREAD_KNOWN {
            return 1.0;
        }
        let rho = within(self.tie / self.spread.max(1e-12), 0.0, 0.9);
        (1.0 + rho) / (1.0 - rho)
    }

    /// Covariance of slowly varying parameters, widened where residuals are larger than expected or hang together; no variance
    /// exceeds that of the start, which was known without any sample.
    pub fn widened(&self) -> SMatrix<Real, N, N> {
        let spread = self.spread().max(1.0);
        let mut belief = self.belief;
        belief.P *= spread * spread * self.correlation_factor();
        belief.limit_variance(&self.prior);
        belief.P
    }

    /// Keeps the numbers usable where samples make no sense: parameters, scaled so that they should be about 1, stop at a thousand. Limits
    /// of what is plausible do not belong here but where the parameters are told: a parameter cut back without those it hangs together with
    /// contradicts all samples before.
    pub fn keep_usable(&mut self) {
        self.belief.x = self
            .belief
            .x
            .map(|x| within(x, -BEYOND_REASON, BEYOND_REASON));
    }

    /// Updates made so far.
    pub fn updates(&self) -> u32 {
        self.updates
    }

    /// Gives the parameters for which `which` is not 0 their prior variance back and forgets their correlations.
    pub fn reopen(&mut self, which: &SVector<Real, N>) {
        let kept = which.map(|w| if w == 0.0 { 1.0 } else { 0.0 });
        let D = SMatrix::from_diagonal(&kept);
        let opened = kept.zip_map(&self.prior, |kept, prior| (1.0 - kept) * prior);
        self.belief.P = D * self.belief.P * D + SMatrix::from_diagonal(&opened);
        self.factors = self.factors.map(|_| Factors::of(&self.belief.P));
    }
}

/// Vahidi et al. 2005, for any number of parameters: each has its own variance and factor, the gains share
/// one denominator D = r + Σ Pᵢ hᵢ² / λᵢ.
#[inline]
fn update_multiple<const N: usize>(
    belief: &mut Gaussian<N>,
    residual: Real,
    h: &SVector<Real, N>,
    r: Real,
    lambdas: &SVector<Real, N>,
) -> Option<()> {
    let P = belief.P.diagonal().component_div(lambdas);
    let D = r + P.dot(&h.component_mul(h));
    if !(D > 0.0 && D.is_finite()) {
        return None;
    }
    belief.x += P.component_mul(h) * (residual / D);
    let P = P.zip_map(h, |P, h| P * r / (r + P * h * h));
    belief.P = SMatrix::from_diagonal(&P);
    Some(())
}

state!(Outcome { residual, normalised, lambda, limited; });

impl<const N: usize> State for Rls<N> {
    fn visit(&mut self, archive: &mut Archive) {
        let Self {
            belief,
            factors,
            spread,
            tie,
            last,
            updates,
            prior: _,
            policy: _,
        } = self;
        belief.visit(archive);
        visit_built(factors, archive);
        spread.visit(archive);
        archive.require(*spread >= 0.0);
        tie.visit(archive);
        last.visit(archive);
        updates.visit(archive);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;
    use nalgebra::{Matrix2, Vector2, vector};
    use std::vec::Vec;

    const PRIOR_SD: [Real; 2] = [10.0, 20.0];

    fn samples(count: usize) -> Vec<(Real, Vector2<Real>)> {
        let mut random = Random::new(7);
        (0..count)
            .map(|_| {
                let h = vector![1.0 + random.normal(), random.normal()];
                (3.0 * h.x - 2.0 * h.y + 0.1 * random.normal(), h)
            })
            .collect()
    }

    fn prior() -> Gaussian<2> {
        Gaussian::independent(vector![1.0, 1.0], PRIOR_SD.into())
    }

    /// Batch weighted least squares with the prior as a first, equally forgotten, measurement.
    fn batch(samples: &[(Real, Vector2<Real>)], lambdas: &[Real], r: Real) -> Vector2<Real> {
        let mut information: Matrix2<Real> = prior().P.try_inverse().unwrap();
        let mut vector = information * prior().x;
        for ((y, h), lambda) in samples.iter().zip(lambdas) {
            information = information * *lambda + h * h.transpose() / r;
            vector = vector * *lambda + h * *y / r;
        }
        information.try_inverse().unwrap() * vector
    }

    #[test]
    fn equals_batch_weighted_least_squares() {
        let samples = samples(200);
        let constant: Vec<Real> = samples.iter().map(|_| 0.98).collect();
        let time: Vec<Real> = (1..=200).map(|k| 1.0 - 0.05 * 0.98f64.powi(k)).collect();
        let ones: Vec<Real> = samples.iter().map(|_| 1.0).collect();
        for (policy, lambdas) in [
            (Forgetting::None, ones),
            (Forgetting::Constant(0.98), constant),
            (
                Forgetting::TimeLaw {
                    loss: 0.05,
                    decay: 0.98,
                },
                time,
            ),
        ] {
            let mut rls = Rls::new(prior(), policy);
            rls.prior *= 100.0; // no wind-up limit: the batch has none
            for (y, h) in &samples {
                let outcome = rls.update(*y, h, 0.01, false).unwrap();
                assert!(!outcome.limited);
            }
            let oracle = batch(&samples, &lambdas, 0.01);
            assert!(
                (rls.belief.x - oracle).norm() < 1e-9,
                "{policy:?}: {} against {oracle}",
                rls.belief.x
            );
        }
    }

    #[test]
    fn dynamic_forgetting_equals_batch_with_the_factors_it_chose() {
        let samples = samples(200);
        let mut rls = Rls::new(
            prior(),
            Forgetting::Dynamic {
                floor: 0.95,
                sharpness: 1.0,
                first: 0.98,
            },
        );
        rls.prior *= 100.0; // no wind-up limit: the batch has none
        let lambdas: Vec<Real> = samples
            .iter()
            .map(|(y, h)| rls.update(*y, h, 0.01, false).unwrap().lambda)
            .collect();
        assert!(lambdas.iter().all(|l| (0.95..=1.0).contains(l)));
        assert!(
            lambdas.iter().skip(20).any(|l| *l < 0.97)
                && lambdas.iter().skip(20).any(|l| *l > 0.99)
        );
        assert!((rls.belief.x - batch(&samples, &lambdas, 0.01)).norm() < 1e-9);
    }

    #[test]
    fn the_square_root_form_agrees_to_rounding_under_every_policy() {
        for policy in [
            Forgetting::None,
            Forgetting::Constant(0.95),
            Forgetting::Multiple([0.99, 0.9]),
            Forgetting::Dynamic {
                floor: 0.9,
                sharpness: 1.0,
                first: 0.98,
            },
        ] {
            let mut plain = Rls::new(prior(), policy);
            let mut factored = plain.in_square_root_form(true);
            let mut limited = 0;
            for (k, (y, h)) in samples(2000).into_iter().enumerate() {
                // Half of the time only the first parameter is seen, so that the limit on the other one acts.
                let h = if k % 1000 < 500 { h } else { vector![h.x, 0.0] };
                if k == 700 {
                    plain.reopen(&vector![1.0, 0.0]);
                    factored.reopen(&vector![1.0, 0.0]);
                }
                let a = plain.update(y, &h, 0.01, k % 7 == 0).unwrap();
                let b = factored.update(y, &h, 0.01, k % 7 == 0).unwrap();
                limited += usize::from(a.limited && b.limited);
                let scale = plain.belief.P.norm();
                assert!(
                    (plain.belief.x - factored.belief.x).norm() < 1e-9,
                    "{policy:?} {k}"
                );
                assert!((plain.belief.P - factored.belief.P).norm() < 1e-9 * scale);
                assert!((a.lambda - b.lambda).abs() < 1e-9);
            }
            assert!(
                matches!(policy, Forgetting::None) || limited > 10,
                "{policy:?}"
            );
        }
    }

    #[test]
    fn multiple_forgetting_with_one_parameter_is_constant_forgetting() {
        let prior = Gaussian::<1>::independent(vector![1.0], vector![10.0]);
        let mut multiple = Rls::new(prior, Forgetting::Multiple([0.97]));
        let mut constant = Rls::new(prior, Forgetting::Constant(0.97));
        for (y, h) in samples(100) {
            multiple.update(y, &vector![h.x], 0.01, false).unwrap();
            constant.update(y, &vector![h.x], 0.01, false).unwrap();
            assert!((multiple.belief.x - constant.belief.x).norm() < 1e-10);
            assert!((multiple.belief.P - constant.belief.P).norm() < 1e-10);
        }
    }

    #[test]
    fn multiple_forgetting_follows_the_parameter_that_moves() {
        let mut random = Random::new(8);
        let mut rls = Rls::new(prior(), Forgetting::Multiple([1.0, 0.9]));
        for k in 0..2000 {
            let drift = (k as Real * 0.005).sin() * 5.0;
            let h = vector![1.0 + random.normal(), 1.0];
            rls.update(3.0 * h.x + drift, &h, 0.01, false).unwrap();
            if k > 500 {
                assert!(
                    (rls.belief.x.y - drift).abs() < 0.6,
                    "{k}: {} {drift}",
                    rls.belief.x
                );
                assert!((rls.belief.x.x - 3.0).abs() < 0.4, "{k}: {}", rls.belief.x);
            }
        }
    }

    #[test]
    fn an_unexcited_regressor_cannot_wind_up_the_covariance() {
        let mut rls = Rls::new(prior(), Forgetting::Constant(0.9));
        for _ in 0..10_000 {
            rls.update(1.0, &vector![1.0, 0.0], 0.01, false).unwrap();
        }
        let allowed = Vector2::from(PRIOR_SD).component_mul(&Vector2::from(PRIOR_SD));
        assert!(
            rls.belief
                .P
                .diagonal()
                .zip_map(&allowed, |p, most| p <= most * 1.000_001)
                .iter()
                .all(|ok| *ok)
        );
    }

    #[test]
    fn dynamic_forgetting_catches_up_with_a_jump_before_plain_least_squares() {
        let mut dynamic = Rls::new(
            prior(),
            Forgetting::Dynamic {
                floor: 0.9,
                sharpness: 0.3,
                first: 0.98,
            },
        );
        let mut plain = Rls::new(prior(), Forgetting::None);
        for (k, (y, h)) in samples(400).iter().enumerate() {
            let y = if k < 300 { *y } else { y + h.x };
            dynamic.update(y, h, 0.01, false).unwrap();
            plain.update(y, h, 0.01, false).unwrap();
        }
        assert!((dynamic.belief.x.x - 4.0).abs() < 0.1);
        assert!((plain.belief.x.x - 4.0).abs() > 0.4);
    }

    #[test]
    fn refuses_numbers_it_cannot_use_and_keeps_its_state() {
        let mut rls = Rls::new(prior(), Forgetting::None);
        let before = rls;
        assert!(
            rls.update(Real::NAN, &vector![1.0, 0.0], 1.0, false)
                .is_none()
        );
        assert!(
            rls.update(1.0, &vector![Real::INFINITY, 0.0], 1.0, false)
                .is_none()
        );
        assert!(
            rls.update(1.0, &vector![1.0, 0.0], Real::NAN, false)
                .is_none()
        );
        assert_eq!(rls, before);
    }

    #[test]
    fn residuals_that_hang_together_are_noticed() {
        // Residuals of an AR(1) process with ρ = 0.5 make the mean three times as uncertain as white ones.
        let mut random = Random::new(9);
        let factor = |rho: Real, random: &mut Random| {
            let mut rls = Rls::new(
                Gaussian::<1>::independent(vector![0.0], vector![10.0]),
                Forgetting::None,
            );
            let (mut noise, mut sum) = (0.0, 0.0);
            for k in 0..5000 {
                noise = rho * noise + (1.0 - rho * rho).sqrt() * random.normal();
                rls.update(noise, &vector![1.0], 1.0, false).unwrap();
                sum += if k >= 1000 {
                    rls.correlation_factor() / 4000.0
                } else {
                    0.0
                };
            }
            sum
        };
        assert!(factor(0.0, &mut random) < 1.3);
        let tied = factor(0.5, &mut random);
        assert!((2.4..3.6).contains(&tied), "{tied}");
    }

    #[test]
    fn reopening_touches_only_the_named_parameter() {
        let mut rls = Rls::new(prior(), Forgetting::None);
        for (y, h) in samples(50) {
            rls.update(y, &h, 0.01, false).unwrap();
        }
        let kept = rls.belief.P.m22;
        rls.reopen(&vector![1.0, 0.0]);
        assert_eq!(rls.belief.P.m11, 100.0);
        assert_eq!(rls.belief.P.m12, 0.0);
        assert_eq!(rls.belief.P.m22, kept);
    }
}
