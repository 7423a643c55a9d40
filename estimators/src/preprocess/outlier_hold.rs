//! Outlier hold of one channel: bridges a jump of one or two samples.

use crate::Real;
use crate::api::snapshot::state;

/// A sample is an outlier beyond the floor and this many times the usual step from sample to sample.
const THRESHOLD: Real = 6.0;

/// Samples in a row that may be held out; what has stayed for longer is real.
const MAX_HELD: u32 = 2;

/// Samples that the usual step looks back on.
const MEMORY: Real = 64.0;

/// Outlier hold: a sample that jumps further from the last accepted one than the channel can is held out, for two samples at most.
///
/// Joints and bumps make a wheel's speed jump by 0.5 to 1.3 m/s and an accelerometer by many m/s² for one or two samples; low-passes and
/// derivatives in front of a regression have no innovation to gate. Without an outlier nothing is delayed and nothing changed. It is the
/// causal decision filter of Hampel (1974) with the last accepted sample in place of the median, and the running mean of steps, clipped
/// at the threshold, in place of the median deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutlierHold {
    floor: Real,
    last: Option<Real>,
    step: Real,
    held: u32,
}

impl OutlierHold {
    /// Steps up to `floor`, in the unit of the channel, are never outliers.
    pub fn new(floor: Real) -> Self {
        Self {
            floor,
            last: None,
            step: 0.0,
            held: 0,
        }
    }

    /// Takes a new sample; `None` if it is held out. `slack` widens the floor by what the channel may have moved since the sample before.
    pub fn take(&mut self, value: Real, slack: Real) -> Option<Real> {
        let Some(last) = self.last else {
            self.last = Some(value);
            return Some(value);
        };
        let limit = self.floor + slack + THRESHOLD * self.step;
        let step = (value - last).abs();
        self.step += (step.min(limit) - self.step) / MEMORY;
        if step > limit && self.held < MAX_HELD {
            self.held += 1;
            return None;
        }
        (self.last, self.held) = (Some(value), 0);
        Some(value)
    }

    /// Forgets the last sample: the channel has paused for so long that the next may be anything.
    pub fn restart(&mut self) {
        (self.last, self.held) = (None, 0);
    }

    /// The last sample accepted.
    pub fn value(&self) -> Option<Real> {
        self.last
    }
}

state!(OutlierHold { last, step, held; floor });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    #[test]
    fn jumps_of_one_or_two_samples_are_held_out() {
        let mut hold = OutlierHold::new(0.05);
        let mut random = Random::new(94);
        for k in 0..10_000 {
            let bump = match k % 100 {
                50 | 51 => 1.3,
                75 => -0.5,
                _ => 0.0,
            };
            let value = 1.0 + 0.005 * random.normal() + bump;
            assert_eq!(hold.take(value, 0.0).is_none(), bump != 0.0, "{k}");
        }
    }

    #[test]
    fn what_stays_is_real() {
        let mut hold = OutlierHold::new(0.05);
        for _ in 0..100 {
            hold.take(1.0, 0.0);
        }
        let taken: std::vec::Vec<_> = (0..4).map(|_| hold.take(3.6, 0.0)).collect();
        assert_eq!(taken, [None, None, Some(3.6), Some(3.6)]);
    }

    #[test]
    fn after_a_pause_the_first_sample_counts() {
        let mut hold = OutlierHold::new(0.05);
        hold.take(1.0, 0.0);
        hold.restart();
        assert_eq!(hold.take(5.0, 0.0), Some(5.0));
    }

    #[test]
    fn noise_and_ramps_pass_at_once() {
        let mut random = Random::new(95);
        let mut noise = OutlierHold::new(0.05);
        let mut ramp = OutlierHold::new(0.05);
        let held = (0..10_000).filter(|_| noise.take(random.normal(), 0.0).is_none());
        assert!(held.count() < 100); // while the usual step is not yet known
        assert!((0..1000).all(|k| ramp.take(0.04 * Real::from(k), 0.0).is_some()));
    }

    #[test]
    fn the_value_is_the_last_one_accepted_and_slack_widens_the_limit() {
        let mut hold = OutlierHold::new(0.05);
        assert_eq!(hold.value(), None);
        assert_eq!(hold.take(1.0, 0.0), Some(1.0));
        assert_eq!((hold.take(1.2, 0.1), hold.value()), (None, Some(1.0)));
        let mut hold = OutlierHold::new(0.05);
        hold.take(1.0, 0.0);
        assert_eq!((hold.take(1.2, 0.2), hold.value()), (Some(1.2), Some(1.2)));
    }
}
