//! Dynamic lag of a filter: what its estimate has moved by within its settling time counts as uncertain.

use crate::Real;
use crate::api::real::sqrt;
use crate::api::signals::Value;
use crate::api::snapshot::state;
use crate::filters::lag_share::LagShare;
use crate::tuning::STATISTICS;

/// Dynamic lag of one estimate.
///
/// The covariance of a filter whose state is a random walk does not depend on the rate of the state now: on a ramp the
/// estimate trails by its rate times the settling time, and after a step (a jerk, a start, an instrument that is back)
/// it is on its way from somewhere else (the dynamic lag, or bias, of a manoeuvring target: Bar-Shalom, Li &
/// Kirubarajan 2001, section 11.2). With d the estimate less its low-pass of the settling time, of which the largest is
/// remembered for that time,
///
/// σ² ← σ² + c² max(d² − (3 σ)², 0)
///
/// An estimate that moves no more than its own noise lets it is left as it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DynamicLag {
    settling_s: Real,
    share: Real,
    slow: Option<Real>,
    moved: Real,
    shares: [LagShare; 2],
}

impl DynamicLag {
    /// Builds the dynamic lag from the settling time of the filter, s, and the uncertain share c of its change; 0:
    /// none.
    pub fn new(settling_s: Real, share: Real) -> Self {
        Self {
            settling_s,
            share,
            slow: None,
            moved: 0.0,
            shares: Default::default(),
        }
    }

    /// Takes the estimate after a step of `dt` seconds, and widens its standard deviation.
    pub fn widen(&mut self, estimate: Value, dt: Real) -> Value {
        let [low, memory] = &mut self.shares;
        let slow = self.slow.get_or_insert(estimate.value);
        *slow += low.of(dt, self.settling_s) * (estimate.value - *slow);
        let moved = (estimate.value - *slow).abs();
        self.moved -= memory.of(dt, self.settling_s) * self.moved;
        self.moved = self.moved.max(moved);
        let noise = STATISTICS.noise_sd * estimate.sd;
        let excess = (self.moved * self.moved - noise * noise).max(0.0);
        Value {
            sd: sqrt(estimate.sd * estimate.sd + self.share * self.share * excess),
            ..estimate
        }
    }
}

state!(DynamicLag { slow, moved; settling_s, share, shares } where |this| this.moved >= 0.0);

#[cfg(test)]
mod tests {
    use super::*;

    fn value(value: Real) -> Value {
        Value {
            value,
            sd: 0.01,
            valid: true,
        }
    }

    /// A first-order filter of the settling time T trails a ramp of rate r by r T: that is the d of the formula.
    #[test]
    fn on_a_ramp_it_is_the_rate_times_the_settling_time() {
        let mut of = DynamicLag::new(0.5, 0.5);
        let last = (0..1000).map(|k| of.widen(value(0.2 * 0.01 * k as Real), 0.01));
        let expected = sqrt(0.01 * 0.01 + 0.25 * (0.1 * 0.1 - 0.03 * 0.03));
        assert!((last.last().unwrap().sd / expected - 1.0).abs() < 0.05);
    }

    #[test]
    fn a_step_is_uncertain_until_it_is_forgotten_and_noise_never() {
        let mut of = DynamicLag::new(0.5, 0.5);
        let (mut sds, mut none) = (std::vec::Vec::new(), DynamicLag::new(0.5, 0.0));
        for k in 0..1000 {
            let noise = if k % 2 == 0 { 0.01 } else { -0.01 };
            let step = if k < 300 { 0.0 } else { 0.2 };
            sds.push(of.widen(value(step + noise), 0.01).sd);
            assert_eq!(none.widen(value(step + noise), 0.01).sd, 0.01);
        }
        assert!(sds[299] == 0.01 && sds[301] > 0.09, "{}", sds[301]);
        assert!(sds[350] > 0.035 && sds[999] == 0.01, "{}", sds[350]);
    }
}
