//! Matched causal low-pass: two cascaded first-order sections, and the derivative from the same states.
//!
//! All signals that meet in one regression go through the *same* filter, so that both sides of the equation are delayed
//! and smoothed alike; filters that differ would bias the parameter between them.

use crate::Real;
use crate::api::real::PI;
use crate::api::snapshot::state;
use crate::filters::lag_share::LagShare;

/// Two cascaded first-order low-pass sections, each s ← s + (1 − e^(−dt/τ)) (u − s), τ = 1/(2π f).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MatchedFilter {
    tau_s: Real,
    share: LagShare,
    sections: Option<[Real; 2]>,
    rate: Real,
}

impl MatchedFilter {
    /// A filter whose sections have their corner at `cutoff_hz` > 0.
    pub fn new(cutoff_hz: Real) -> Self {
        Self {
            tau_s: 1.0 / (2.0 * PI * cutoff_hz),
            share: LagShare::default(),
            sections: None,
            rate: 0.0,
        }
    }

    /// One sample held for `dt_s`. The first one fills the filter.
    pub fn step(&mut self, input: Real, dt_s: Real) {
        let Some([first, second]) = self.sections else {
            self.sections = Some([input, input]);
            return;
        };
        let share = self.share.of(dt_s, self.tau_s);
        let first = first + share * (input - first);
        let moved = share * (first - second);
        self.sections = Some([first, second + moved]);
        self.rate = moved / dt_s;
    }

    /// Forgets everything: the next sample fills the filter anew.
    pub fn empty(&mut self) {
        self.sections = None;
        self.rate = 0.0;
    }

    /// The smoothed input; `None` before the first sample.
    pub fn value(&self) -> Option<Real> {
        self.sections.map(|[_, second]| second)
    }

    /// The smoothed derivative of the input, per second: what [`MatchedFilter::value`] would be for the derivative as
    /// input.
    pub fn rate(&self) -> Real {
        self.rate
    }
}

state!(MatchedFilter { sections, rate; tau_s, share });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    #[test]
    fn derivative_matches_the_filter_of_the_derivative() {
        // Filtering commutes with differencing: rate of the filtered ramp-with-noise = filtered difference quotient.
        let mut random = Random::new(5);
        let (mut of_signal, mut of_difference) = (MatchedFilter::new(1.0), MatchedFilter::new(1.0));
        let dt = 0.005;
        let mut signal = 0.0;
        of_signal.step(signal, dt);
        of_difference.step(0.0, dt);
        for _ in 0..2000 {
            let step = dt * (1.0 + random.normal());
            signal += step;
            of_signal.step(signal, dt);
            of_difference.step(step / dt, dt);
            assert!((of_signal.rate() - of_difference.value().unwrap()).abs() < 1e-9);
        }
    }

    #[test]
    fn halves_the_amplitude_at_its_corner_and_passes_constants() {
        // |1/(1 + jωτ)²| = 1/2 at the corner.
        let (cutoff, dt) = (1.0, 1e-4);
        let mut filter = MatchedFilter::new(cutoff);
        let mut peak: Real = 0.0;
        for k in 0..100_000 {
            let t = k as Real * dt;
            filter.step((2.0 * PI * cutoff * t).sin(), dt);
            if t > 5.0 {
                peak = peak.max(filter.value().unwrap());
            }
        }
        assert!((peak - 0.5).abs() < 0.002, "{peak}");
        let mut filter = MatchedFilter::new(cutoff);
        for _ in 0..10 {
            filter.step(3.0, 0.01);
        }
        assert_eq!(filter.value(), Some(3.0));
        assert_eq!(filter.rate(), 0.0);
    }
}
