//! Stuck-at fault detector of an instrument with one axis or several.
//!
//! A repeated value is a fault only of an instrument whose noise moves it from sample to sample. One that often repeats
//! a value legitimately (coarse quantisation, no noise, a train at rest) is never flagged.

use crate::api::snapshot::state;
use crate::tuning::{STATISTICS, STUCK, TIMES};
use crate::{Real, Time};

/// Stuck-at fault detector of an instrument that repeats a sample.
///
/// One axis is stuck from 20 repetitions and more than 0.5 s on, and never at 0: a wheel at rest or a motor without
/// torque reads that. Noise never repeats all axes of a vector, which is stuck from 3 repetitions on, whatever the
/// time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StuckDetector<const N: usize> {
    changes: u32,
    legitimate_repeats: u32,
    run: u32,
    changed: Time,
}

impl<const N: usize> StuckDetector<N> {
    /// Takes a new sample and the previous sample, at an instant of the estimator's clock.
    #[inline]
    pub fn take(&mut self, value: [Real; N], before: [Real; N], now: Time) {
        if value == before && (N > 1 || value != [0.0; N]) {
            self.run = self.run.saturating_add(1);
            return;
        }
        if self.run > 0 && !self.is_stuck(now) {
            self.legitimate_repeats = self.legitimate_repeats.saturating_add(self.run);
        }
        self.changes = self.changes.saturating_add(1);
        (self.run, self.changed) = (0, now);
    }

    /// Returns true if the instrument is stuck.
    #[inline]
    pub fn is_stuck(&self, now: Time) -> bool {
        let repeats = match N {
            1 => STUCK.max_repeats,
            _ => STATISTICS.in_a_row,
        };
        if self.run < repeats {
            return false;
        }
        let noisy = self.changes >= STUCK.min_changes_per_repeat
            && self
                .legitimate_repeats
                .saturating_mul(STUCK.min_changes_per_repeat)
                < self.changes;
        noisy && (N > 1 || now.since(self.changed) > TIMES.lost_s)
    }

    /// Returns true if the instrument has repeated its first sample ever since: in motion only one without noise does.
    #[inline]
    pub fn never_changed(&self) -> bool {
        self.changes == 0 && self.run >= STUCK.max_repeats
    }
}

state!(@[const N: usize] StuckDetector<N> { changes, legitimate_repeats, run, changed; });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    /// Returns true if it is found stuck after `count` samples at 100 Hz, then `held` more of the last value.
    fn stuck(mut signal: impl FnMut(u32) -> Real, count: u32, held: u32) -> bool {
        let at = |k: u32| Time::from_ns(10_000_000 * i64::from(k));
        let (mut repeats, mut last) = (StuckDetector::default(), signal(0));
        for k in 1..=count + held {
            let value = if k <= count { signal(k) } else { last };
            repeats.take([value], [last], at(k));
            last = value;
            assert!(k > count || !repeats.is_stuck(at(k)));
        }
        repeats.is_stuck(at(count + held))
    }

    #[test]
    fn noise_that_stops_is_flagged_and_noise_that_goes_on_is_not() {
        let mut random = Random::new(81);
        assert!(stuck(|_| 1.0 + 0.005 * random.normal(), 1000, 60));
        assert!(!stuck(|_| 1.0 + 0.005 * random.normal(), 1000, 40));
        assert!(!stuck(|_| 1.0 + 0.005 * random.normal(), 99, 60));
    }

    /// A slow channel is stuck by the number of its repetitions, twenty, and a fast one by the time of half a second.
    #[test]
    fn twenty_repetitions_and_half_a_second_are_stuck() {
        for (period_ns, first) in [(100_000_000, 20), (10_000_000, 51), (25_000_000, 21)] {
            let mut detector = StuckDetector::default();
            let mut now = Time::from_ns(0);
            for k in 0..300_u16 {
                detector.take([2.0 + Real::from(k % 2)], [3.0 - Real::from(k % 2)], now);
            }
            let repeats = (1..200).find(|_| {
                now = Time::from_ns(now.ns() + period_ns);
                detector.take([1.0], [1.0], now);
                detector.is_stuck(now)
            });
            assert_eq!(repeats, Some(first), "{period_ns} ns");
        }
    }

    #[test]
    fn legitimate_repeats_are_not_flagged() {
        let mut random = Random::new(82);
        // Steps coarser than the noise; a ramp in steps, then a plateau; no noise at all; a train that stops.
        let step = |x: Real| (x / 0.01).round() * 0.01;
        assert!(!stuck(|_| step(1.0 + 0.005 * random.normal()), 5000, 500));
        assert!(!stuck(|k| step(0.0005 * Real::from(k)), 1000, 500));
        assert!(!stuck(|_| 1.0, 1000, 500));
        assert!(!stuck(|k| Real::from(1000 - k.min(1000)), 1000, 500));
    }

    #[test]
    fn one_legitimate_repeat_in_a_hundred_changes_is_a_sensor_that_repeats() {
        for (repeats, noisy) in [(1, true), (2, false)] {
            let mut detector = StuckDetector::default();
            let at = |k: u32| Time::from_ns(10_000_000 * i64::from(k));
            let mut last = 0.5;
            for k in 1..=200 + repeats {
                let value = if k <= repeats + 1 { 1.0 } else { Real::from(k) };
                detector.take([value], [last], at(k));
                last = value;
            }
            for k in 300..=400 {
                detector.take([last], [last], at(k));
            }
            assert_eq!(detector.is_stuck(at(400)), noisy, "{repeats} {detector:?}");
        }
    }

    /// A vector that has repeated itself once in a hundred changes repeats itself again; one that has not done so is
    /// stuck from the third repetition on, and at 0 like anywhere else.
    #[test]
    fn a_vector_that_repeats_itself_now_and_then_is_not_stuck() {
        for (changes, repeats, stuck) in [
            (99, 0, false),
            (100, 0, true),
            (100, 1, false),
            (101, 1, true),
            (200, 2, false),
        ] {
            for offset in [0, changes] {
                let mut vector = StuckDetector::default();
                let (mut last, mut now) = ([Real::NAN; 3], Time::from_ns(0));
                let mut take = |k: i32| {
                    let value = [0.0, 0.0, Real::from(k - offset)];
                    now = Time::from_ns(now.ns() + 5_000_000);
                    vector.take(value, last, now);
                    last = value;
                    vector.is_stuck(now)
                };
                for k in 1..=changes {
                    assert!(!take(k));
                    if k <= repeats {
                        take(k);
                    }
                }
                let [first, second, third] = [0; 3].map(|_| take(changes));
                assert!(!first && !second);
                assert_eq!(third, stuck, "{changes} {repeats}");
            }
        }
    }
}
