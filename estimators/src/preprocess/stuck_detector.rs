//! A sensor that hangs at a value: it sends on, bit for bit the same.
//!
//! Whether a value that stays is frozen or true can only be told of a sensor whose noise moves it from sample to sample. One that has
//! often sent the same value twice (coarse steps, no noise, a train at rest) is never accused, and 0 is nobody's frozen value.

use crate::api::snapshot::state;
use crate::{Real, Time};

/// Same values in a row, and time without another one, s, that no noise makes.
const TOO_MANY: u32 = 20;
const TOO_LONG_S: Time = 0.5;
/// Changes after which a sensor is known, and how many of them there must be for each legitimate_repeats repetition.
const KNOWN: u32 = 200;
const NOISY: u32 = 100;

/// How often a sensor repeats itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StuckDetector {
    changes: u32,
    legitimate_repeats: u32,
    run: u32,
    changed_s: Time,
}

impl StuckDetector {
    /// A new sample after an older one.
    pub fn take(&mut self, value: Real, before: Real, now_s: Time) {
        if value == before && value != 0.0 {
            self.run = self.run.saturating_add(1);
            return;
        }
        if !self.frozen(now_s) {
            self.legitimate_repeats = self.legitimate_repeats.saturating_add(self.run);
        }
        self.changes = self.changes.saturating_add(1);
        (self.run, self.changed_s) = (0, now_s);
    }

    /// Whether it hangs.
    pub fn frozen(&self, now_s: Time) -> bool {
        let noisy =
            self.changes >= KNOWN && self.legitimate_repeats.saturating_mul(NOISY) < self.changes;
        noisy && self.run >= TOO_MANY && now_s - self.changed_s > TOO_LONG_S
    }
}

state!(StuckDetector { changes, legitimate_repeats, run, changed_s; });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    /// Frozen after `count` samples at 100 Hz, then `hang` more of the last value.
    fn hangs(mut signal: impl FnMut(u32) -> Real, count: u32, hang: u32) -> bool {
        let (mut repeats, mut last) = (StuckDetector::default(), signal(0));
        for k in 1..=count + hang {
            let value = if k <= count { signal(k) } else { last };
            repeats.take(value, last, 0.01 * Time::from(k));
            last = value;
            assert!(k > count || !repeats.frozen(0.01 * Time::from(k)));
        }
        repeats.frozen(0.01 * Time::from(count + hang))
    }

    #[test]
    fn noise_that_stops_is_found_and_noise_that_goes_on_is_not() {
        let mut random = Random::new(81);
        assert!(hangs(|_| 1.0 + 0.005 * random.normal(), 1000, 60));
        assert!(!hangs(|_| 1.0 + 0.005 * random.normal(), 1000, 40));
        assert!(!hangs(|_| 1.0 + 0.005 * random.normal(), 100, 60));
    }

    #[test]
    fn who_repeats_himself_honestly_is_not_accused() {
        let mut random = Random::new(82);
        // Steps coarser than the noise; a ramp in steps, then a plateau; no noise at all; a train that stops.
        let step = |x: Real| (x / 0.01).round() * 0.01;
        assert!(!hangs(|_| step(1.0 + 0.005 * random.normal()), 5000, 500));
        assert!(!hangs(|k| step(0.0005 * Real::from(k)), 1000, 500));
        assert!(!hangs(|_| 1.0, 1000, 500));
        assert!(!hangs(|k| Real::from(1000 - k.min(1000)), 1000, 500));
    }
}
