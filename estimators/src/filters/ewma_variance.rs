//! Exponentially weighted moving average (EWMA) of a signal and of its square deviation.

use crate::Real;
use crate::api::real::sqrt;
use crate::api::snapshot::state;

/// EWMA variance: exponentially weighted mean and variance of a signal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EwmaVariance {
    mean: Option<Real>,
    variance: Real,
}

impl EwmaVariance {
    /// Takes in a value with this `share` of the new mean.
    pub fn add(&mut self, value: Real, share: Real) {
        let Some(mean) = self.mean else {
            self.mean = Some(value);
            return;
        };
        let away = value - mean;
        self.mean = Some(mean + share * away);
        self.variance = (1.0 - share) * (self.variance + share * away * away);
    }

    /// Variance, in the square of the signal's unit.
    pub fn variance(&self) -> Real {
        self.variance
    }

    /// Standard deviation, in the signal's unit.
    pub fn sd(&self) -> Real {
        sqrt(self.variance)
    }
}

state!(EwmaVariance { mean, variance; } where |this| this.variance >= 0.0);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    #[test]
    fn finds_the_deviation_of_noise_and_none_in_a_constant() {
        let (mut noise, mut still) = (EwmaVariance::default(), EwmaVariance::default());
        let mut random = Random::new(61);
        for _ in 0..10_000 {
            noise.add(7.0 + 2.0 * random.normal(), 0.01);
            still.add(7.0, 0.01);
        }
        assert!((1.7..2.3).contains(&noise.sd()), "{}", noise.sd());
        assert_eq!(still.variance(), 0.0);
    }
}
