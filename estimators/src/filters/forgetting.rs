//! Forgetting of recursive least squares.
//!
//! | policy | forgetting | source |
//! |---|---|---|
//! | [`Forgetting::None`] | λ = 1 | Plackett 1950 |
//! | [`Forgetting::Constant`] | λ constant | Åström & Wittenmark 1995 |
//! | [`Forgetting::Dynamic`] | λ = δ + (1 − δ) exp(−σ Δ), Δ = size of the residual | Liu et al. 2023, eq. 19 |
//! | [`Forgetting::ByResidual`] | the same with Δ in the unit of the residual | Liu et al. 2023, eq. 19, to the letter |
//! | [`Forgetting::Multiple`] | one λ for each parameter, each with a variance of its own | Vahidi, Stefanopoulou & Peng 2005 |
//! | [`Forgetting::TimeLaw`] | λ = 1 − a bᵏ | patent CN 111507019 B, with a = 0.05 and b = 0.98 |

use crate::Real;
use crate::api::real::{exp, pow};

/// Updates after which running statistics of the residual are trusted.
pub(crate) const SPREAD_KNOWN: u32 = 10;

/// Rule by which old samples lose weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Forgetting<const N: usize> {
    /// All samples weigh the same.
    None,
    /// A sample's weight falls by this factor at each new one.
    Constant(Real),
    /// Forgets more when the residual is large: λ = floor + (1 − floor) exp(−sharpness · Δ), where Δ is the residual in
    /// units of its own running standard deviation, so that `sharpness` has no unit.
    Dynamic {
        /// Smallest λ (the paper's δ).
        floor: Real,
        /// Rate at which λ falls with the residual (the paper's σ).
        sharpness: Real,
        /// λ while the running deviation of the residual is not yet known.
        first: Real,
    },
    /// λ = floor + (1 − floor) exp(−sharpness · Δ) with the residual Δ = |y − hᵀχ| as it is: `sharpness` is per unit of
    /// y.
    ByResidual {
        /// Smallest λ (the paper's δ).
        floor: Real,
        /// Rate at which λ falls with the residual (the paper's σ).
        sharpness: Real,
        /// λ of the first sample.
        first: Real,
    },
    /// One factor for each parameter; correlations between parameters are not kept.
    Multiple([Real; N]),
    /// λ = 1 − loss · decayᵏ at update k = 1, 2, …: forgets early samples and then settles.
    TimeLaw {
        /// Loss of weight at k = 0.
        loss: Real,
        /// Factor from one update to the next.
        decay: Real,
    },
}

impl<const N: usize> Forgetting<N> {
    /// λ for a residual of `size` standard deviations ([`Forgetting::ByResidual`]: units), after a number of `updates`.
    /// The smallest, where there are several.
    #[inline]
    pub(crate) fn lambda(&self, size: Real, updates: u32) -> Real {
        match self {
            Forgetting::None => 1.0,
            Forgetting::Constant(lambda) => *lambda,
            Forgetting::Dynamic { first, .. } if updates < SPREAD_KNOWN => *first,
            Forgetting::ByResidual { first, .. } if updates == 0 => *first,
            Forgetting::Dynamic {
                floor, sharpness, ..
            }
            | Forgetting::ByResidual {
                floor, sharpness, ..
            } => floor + (1.0 - floor) * exp(-sharpness * size.abs()),
            Forgetting::Multiple(lambdas) => lambdas.iter().copied().fold(1.0, Real::min),
            Forgetting::TimeLaw { loss, decay } => 1.0 - loss * pow(*decay, updates as Real + 1.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dynamic_forgetting_falls_from_one_to_its_floor() {
        let policy = Forgetting::<1>::Dynamic {
            floor: 0.95,
            sharpness: 0.5,
            first: 0.98,
        };
        assert_eq!(policy.lambda(7.0, 0), 0.98);
        assert_eq!(policy.lambda(0.0, 100), 1.0);
        let mut last = 1.0;
        for size in [0.5, 1.0, 3.0, -10.0] {
            let lambda = policy.lambda(size, 100);
            assert!(lambda < last && lambda > 0.95);
            last = lambda;
        }
        assert!((policy.lambda(1e3, 100) - 0.95).abs() < 1e-12);
    }

    #[test]
    fn the_time_law_settles_at_remembering_all() {
        // The patent's law at t = 1, 100 and 194 samples.
        let law = Forgetting::<1>::TimeLaw {
            loss: 0.05,
            decay: 0.98,
        };
        for (t, expected) in [(1, 0.951), (100, 0.9934), (194, 0.9990)] {
            assert!((law.lambda(0.0, t - 1) - expected).abs() < 1e-4);
        }
    }
}
