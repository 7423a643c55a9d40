//! Outlier hold of one channel: bridges a jump that does not last.

use crate::Real;
use crate::api::snapshot::state;
use crate::tuning;

/// Limits of an outlier hold, in the unit of the channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HoldLimits {
    /// Steps up to this are never outliers.
    pub floor: Real,
    /// Largest change of the channel in a second.
    pub rate: Real,
    /// Time that samples may be held out for, s; what has stayed for longer is real.
    pub longest_s: Real,
}

/// Outlier hold: a sample that jumps further from the last accepted one than the channel can is held out, for a time at
/// most.
///
/// Joints and bumps make a wheel's speed jump by 0.1 to 1.3 m/s and an accelerometer swing by many m/s² for a few
/// samples; low-passes and derivatives in front of a regression have no innovation to gate. Without an outlier nothing
/// is delayed and nothing changed. It is a causal decision filter after Hampel (1974), with the last accepted sample in
/// place of the median, and the running mean of steps, clipped at the threshold, in place of the median deviation. A
/// channel with a period beyond the longest time holds nothing out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutlierHold {
    limits: HoldLimits,
    last: Option<Real>,
    step: Real,
    held_s: Real,
}

impl OutlierHold {
    /// Builds the outlier hold with its limits.
    pub fn new(limits: HoldLimits) -> Self {
        Self {
            limits,
            last: None,
            step: 0.0,
            held_s: 0.0,
        }
    }

    /// Takes a new sample, `period_s` after the one before; `None` if it is held out.
    pub fn take(&mut self, value: Real, period_s: Real) -> Option<Real> {
        let Some(last) = self.last.filter(|_| period_s <= self.limits.longest_s) else {
            (self.last, self.held_s) = (Some(value), 0.0);
            return Some(value);
        };
        let limits = &self.limits;
        let waited_s = self.held_s + period_s;
        let limit =
            limits.floor + limits.rate * waited_s + tuning::STATISTICS.jump_factor * self.step;
        let step = (value - last).abs();
        if self.held_s == 0.0 {
            self.step += (step.min(limit) - self.step) / tuning::OUTLIER_HOLD.memory;
        }
        if step > limit && waited_s <= limits.longest_s {
            self.held_s = waited_s;
            return None;
        }
        (self.last, self.held_s) = (Some(value), 0.0);
        Some(value)
    }

    /// The last sample accepted.
    pub fn value(&self) -> Option<Real> {
        self.last
    }
}

state!(OutlierHold { last, step, held_s; limits });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    const SPEED: HoldLimits = HoldLimits {
        floor: 0.05,
        rate: 3.0,
        longest_s: 0.2,
    };

    #[test]
    fn jumps_that_do_not_last_are_held_out() {
        let mut hold = OutlierHold::new(SPEED);
        let mut random = Random::new(94);
        for k in 0..10_000 {
            let bump = match k % 500 {
                50 | 51 => 1.3,
                75 => -0.5,
                200..215 => 0.6,
                _ => 0.0,
            };
            let value = 1.0 + 0.005 * random.normal() + bump;
            assert_eq!(hold.take(value, 0.01).is_none(), bump != 0.0, "{k}");
        }
    }

    #[test]
    fn what_stays_is_real() {
        let mut hold = OutlierHold::new(SPEED);
        for _ in 0..100 {
            hold.take(1.0, 0.05);
        }
        let taken: std::vec::Vec<_> = (0..6).map(|_| hold.take(3.6, 0.05)).collect();
        assert_eq!(taken[..4], [None; 4]);
        assert_eq!(taken[4..], [Some(3.6); 2]);
    }

    #[test]
    fn noise_and_ramps_pass_at_once() {
        let mut random = Random::new(95);
        let mut noise = OutlierHold::new(SPEED);
        let mut ramp = OutlierHold::new(SPEED);
        let held = (0..10_000).filter(|_| noise.take(0.02 * random.normal(), 0.01).is_none());
        assert!(held.count() < 10);
        assert!((0..1000).all(|k| ramp.take(0.03 * Real::from(k), 0.01).is_some()));
    }

    #[test]
    fn a_slow_channel_and_the_first_sample_after_a_pause_pass() {
        let mut hold = OutlierHold::new(SPEED);
        hold.take(1.0, 0.01);
        assert_eq!(hold.take(5.0, 1.0), Some(5.0));
    }

    /// A sample may jump by the floor, by what the channel can change by since the last one that was taken, and by six
    /// usual steps: after n steps of u these are u (1 − (63/64)ⁿ). What is held out teaches no step.
    #[test]
    fn the_limit_is_the_floor_the_rate_and_six_usual_steps() {
        for (n, u) in [(0, 0.04), (10, 0.04), (64, 0.04), (1_000, 0.04)] {
            for held in 0..3 {
                let mut hold = OutlierHold::new(SPEED);
                for k in 0..=n {
                    let value = if k % 2 == 0 { 0.0 } else { u };
                    assert_eq!(hold.take(value, 0.01), Some(value));
                }
                let last = hold.value().unwrap();
                let usual = u * (1.0 - (63.0 / 64.0 as Real).powi(n));
                let mut limit = 0.05 + 3.0 * 0.01 + 6.0 * usual;
                let learnt = usual + (limit - usual) / 64.0;
                for _ in 0..held {
                    assert_eq!(hold.take(last - 50.0, 0.01), None);
                }
                if held > 0 {
                    limit = 0.05 + 3.0 * 0.01 * Real::from(held + 1) + 6.0 * learnt;
                }
                for (by, taken) in [(0.99, true), (1.01, false), (-0.99, true), (-1.01, false)] {
                    let value = last + by * limit;
                    let found = { hold }.take(value, 0.01);
                    assert_eq!(found, taken.then_some(value), "{n} {held} {by}");
                }
            }
        }
    }
}
