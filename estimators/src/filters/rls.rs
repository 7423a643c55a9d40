//! Recursive least squares: one recursion, several ways to forget.
//!
//! y(k) = hᵀ(k) χ + e(k). A step first forgets, then corrects.
//!
//! λ comes from a policy ([`Forgetting`]).
//!
//! P ← P/λ followed by a correction with noise r is the usual recursion K = P h / (λ r + hᵀ P h), P ← (P − K hᵀ P)/λ
//! (Liu et al. 2023, eq. 20–22, with the a-priori residual of this step).
//!
//! The recursion carries the factors of P ([`Factors`]), the square-root form: exact to rounding where the covariance
//! itself loses its digits and at last its positive definiteness, with near-equal regressors, poor excitation, long
//! runs, single precision. Multiple forgetting keeps variances only.
//!
//! Beside it run two averages of the normalised residual n = e/√(r + hᵀ P h), P before forgetting, over m samples, m
//! the lesser of 50 and k + 1, at update k = 1, 2, …. The first is s² ← s² + (min(n², 25 s²) − s²)/m from s² = 1, the
//! [`Rls::spread`] that makes σ of dynamic forgetting free of units. The second is c, the mean of n times the n before
//! it (held within ±25 s²), from which [`Rls::correlation_factor`] follows.

use nalgebra::{SMatrix, SVector};

use crate::Real;
use crate::api::real::{sqrt, within};
use crate::api::snapshot::state;
use crate::filters::forgetting::{Forgetting, SPREAD_KNOWN};
use crate::filters::gaussian::Gaussian;
use crate::filters::ud::Factors;

/// Limit of a parameter that should be about 1.
const MAX_PRIOR_SD_RATIO: Real = 1e3;

/// Number of updates in the running deviation of the residual.
const SPREAD_MEMORY: Real = 50.0;

/// Results of an update.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outcome {
    /// A-priori residual y − hᵀχ, in the unit of y.
    pub residual: Real,
    /// The same divided by its predicted standard deviation.
    pub normalised: Real,
    /// Forgetting factor used (the smallest of several).
    pub lambda: Real,
    /// True if a variance was cut back to its prior (wind-up limit).
    pub limited: bool,
}

/// Recursive least squares for `N` parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rls<const N: usize> {
    /// Parameters χ and their covariance, for residuals of the variance given to [`Rls::update`].
    pub belief: Gaussian<N>,
    /// Factors of `belief.P`.
    factors: Factors<N>,
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
    /// Starts from a belief about the parameters; no variance will ever exceed its initial value (wind-up limit).
    pub fn new(prior: Gaussian<N>, policy: Forgetting<N>) -> Self {
        Self {
            belief: prior,
            factors: Factors::of(&prior.P),
            prior: prior.P.diagonal(),
            policy,
            spread: 1.0,
            tie: 0.0,
            last: 0.0,
            updates: 0,
        }
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
        let predicted = sqrt(r + self.factors.variance_along(h));
        let normalised = residual / predicted;
        if !normalised.is_finite() {
            return None;
        }

        let size = match self.policy {
            Forgetting::Dynamic { .. } => normalised / self.spread(),
            Forgetting::ByResidual { .. } => residual,
            _ => normalised,
        };
        let lambda = if remember {
            1.0
        } else {
            self.policy.lambda(size, self.updates)
        };
        let (mut belief, mut factors) = (self.belief, self.factors);
        let limited = if let Forgetting::Multiple(lambdas) = self.policy {
            let lambdas = match remember {
                true => SVector::repeat(1.0),
                false => SVector::from(lambdas),
            };
            update_multiple(&mut belief, residual, h, r, &lambdas)?;
            let limited = belief.limit_variance(&self.prior);
            factors = Factors::of(&belief.P);
            limited
        } else {
            (r > 0.0).then_some(())?;
            factors.scale(1.0 / lambda);
            belief.x += factors.update_scalar(h, r) * residual;
            let limited = factors.limit_variance(&self.prior);
            belief.P = factors.covariance();
            limited
        };
        if !belief.is_finite() || !factors.is_finite() {
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

    /// Standard deviation of the residual divided by its predicted standard deviation: 1 when the noise variance given
    /// is right.
    #[inline]
    pub fn spread(&self) -> Real {
        sqrt(self.spread.max(1e-12))
    }

    /// Factor on the variance of slowly varying parameters for the dependence of successive residuals: (1 + ρ)/(1 − ρ),
    /// ρ their correlation; 1 while they are independent, or while too few are known.
    pub fn correlation_factor(&self) -> Real {
        if self.updates < SPREAD_KNOWN {
            return 1.0;
        }
        let rho = within(self.tie / self.spread.max(1e-12), 0.0, 0.9);
        (1.0 + rho) / (1.0 - rho)
    }

    /// A posteriori variance factor, at least 1, times [`Rls::correlation_factor`].
    pub(crate) fn excess(&self) -> Real {
        let spread = self.spread().max(1.0);
        spread * spread * self.correlation_factor()
    }

    /// Covariance of slowly varying parameters, widened if residuals are larger than expected or correlated; no
    /// variance exceeds its initial value, which was known without any sample.
    pub(crate) fn widened(&self) -> SMatrix<Real, N, N> {
        let mut belief = self.belief;
        belief.P *= self.excess();
        belief.limit_variance(&self.prior);
        belief.P
    }

    /// Keeps the numbers usable with senseless samples: parameters, scaled so that they should be about 1, stop at a
    /// thousand. Limits of what is plausible do not belong here but where the parameters are reported: a parameter cut
    /// back without the parameters correlated with it contradicts all samples before.
    pub(crate) fn clamp_usable(&mut self) {
        self.belief.x = self
            .belief
            .x
            .map(|x| within(x, -MAX_PRIOR_SD_RATIO, MAX_PRIOR_SD_RATIO));
    }

    /// Updates made so far.
    pub fn updates(&self) -> u32 {
        self.updates
    }

    /// Adds these shares of the prior variances to the variances of the parameters, up to the prior; correlations are
    /// kept.
    pub(crate) fn inflate(&mut self, shares: &SVector<Real, N>) {
        self.belief.P += SMatrix::from_diagonal(&shares.component_mul(&self.prior));
        self.belief.limit_variance(&self.prior);
        self.factors = Factors::of(&self.belief.P);
    }

    /// Gives the parameters for which `which` is not 0 their prior variance back and forgets their correlations.
    pub fn reset_to_prior(&mut self, which: &SVector<Real, N>) {
        let kept = which.map(|w| if w == 0.0 { 1.0 } else { 0.0 });
        let D = SMatrix::from_diagonal(&kept);
        let opened = kept.zip_map(&self.prior, |kept, prior| (1.0 - kept) * prior);
        self.belief.P = D * self.belief.P * D + SMatrix::from_diagonal(&opened);
        self.factors = Factors::of(&self.belief.P);
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

state!(@[const N: usize] Rls<N> { belief, factors, spread, tie, last, updates; prior, policy } where |rls| rls.spread >= 0.0);

#[cfg(test)]
#[path = "rls_tests.rs"]
mod tests;
