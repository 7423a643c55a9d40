//! Sample and hold of one sensor channel, with a timeout.

use crate::api::signals::Sample;
use crate::api::snapshot::state;
use crate::preprocess::stuck_detector::StuckDetector;
use crate::{Real, Time};

/// Time without a sample after which an older stamp means that the sensor's clock was wrong before, or has been set back, s.
const CLOCK_SET_BACK_S: Real = 1.0;

/// Periods of the channel after which its last sample is stale.
const TIMEOUT_PERIODS: Real = 3.0;

/// Sample and hold of one channel: its last sample is fresh for three of its sample periods, unless the sensor is stuck.
///
/// The timeout goes by the arrival of samples on the estimator's own clock; stamps of the sensor's clock only order the samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SampleHold {
    stamp: Time,
    arrived: Time,
    period_s: Real,
    value: Option<Real>,
    stuck: StuckDetector,
}

impl SampleHold {
    /// Takes a new sample and returns whether it was taken. A sample not younger than the last one is skipped, unless nothing younger has
    /// come for so long that the sensor's clock must have been set back.
    pub fn take(&mut self, sample: Option<Sample<Real>>, now: Time) -> bool {
        let Some(sample) = sample else { return false };
        if let Some(before) = self.value {
            let gap = now.since(self.arrived);
            let set_back = sample.t < self.stamp && gap > CLOCK_SET_BACK_S;
            if !(sample.t > self.stamp || set_back) {
                return false;
            }
            self.stuck.take(sample.value, before, now);
            // A gap after lost samples must not pass for a long sample period.
            self.period_s = if self.period_s > 0.0 {
                gap.min(1.1 * self.period_s)
            } else {
                gap
            };
        }
        (self.stamp, self.arrived, self.value) = (sample.t, now, Some(sample.value));
        true
    }

    /// Whether the sensor is stuck.
    pub fn is_stuck(&self, now: Time) -> bool {
        self.stuck.is_stuck(now)
    }

    /// The held value; `None` once it is stale or while the sensor is stuck. `dt_s` is the estimator's step, the shortest period it can see.
    pub fn fresh(&self, now: Time, dt_s: Real) -> Option<Real> {
        let timeout_s = TIMEOUT_PERIODS * self.period_s.max(dt_s) + 1e-9;
        self.value
            .filter(|_| !self.is_stuck(now))
            .filter(|_| now.since(self.arrived) <= timeout_s)
    }
}

state!(SampleHold { stamp, arrived, period_s, value, stuck; });

#[cfg(test)]
mod tests {
    use super::*;

    fn at(t_s: f64, value: Real) -> Option<Sample<Real>> {
        let t = Time::from_s(t_s);
        Some(Sample { t, value })
    }

    #[test]
    fn a_value_is_fresh_for_three_periods() {
        let mut held = SampleHold::default();
        for k in 1..=10 {
            let t_s = 0.05 * f64::from(k);
            assert!(held.take(at(t_s, 1.0), Time::from_s(t_s)));
        }
        assert_eq!(held.fresh(Time::from_s(0.65), 0.01), Some(1.0));
        assert_eq!(held.fresh(Time::from_s(0.66), 0.01), None);
    }

    #[test]
    fn a_gap_does_not_lengthen_the_timeout_by_more_than_a_tenth() {
        let mut held = SampleHold::default();
        for t_s in [0.0, 0.1, 0.2, 5.0] {
            held.take(at(t_s, 1.0), Time::from_s(t_s));
        }
        assert_eq!(held.fresh(Time::from_s(5.32), 0.01), Some(1.0));
        assert_eq!(held.fresh(Time::from_s(5.34), 0.01), None);
    }

    #[test]
    fn an_older_stamp_is_skipped_until_the_clock_must_have_been_set_back() {
        let mut held = SampleHold::default();
        assert!(held.take(at(100.0, 1.0), Time::from_s(100.0)));
        assert!(!held.take(at(100.0, 2.0), Time::from_s(100.1)));
        assert!(!held.take(at(3.0, 2.0), Time::from_s(100.5)));
        assert!(held.take(at(3.5, 2.0), Time::from_s(101.5)));
        assert_eq!(held.fresh(Time::from_s(101.5), 0.01), Some(2.0));
    }

    #[test]
    fn a_stamp_seen_before_is_never_new_and_a_clock_is_set_back_after_more_than_a_second() {
        let mut held = SampleHold::default();
        assert!(held.take(at(100.0, 1.0), Time::from_s(100.0)));
        assert!(!held.take(at(100.0, 2.0), Time::from_s(105.0)));
        assert!(!held.take(at(99.0, 2.0), Time::from_s(101.0)));
        assert!(held.take(at(99.0, 2.0), Time::from_s(101.001)));
    }

    #[test]
    fn a_stuck_sensor_is_not_fresh() {
        let mut held = SampleHold::default();
        let mut random = crate::testing::Random::new(92);
        let at = |k: i64| Time::from_ns(10_000_000 * k);
        for k in 0..1_000 {
            let value = if k < 900 { random.normal() } else { 0.7 };
            held.take(Some(Sample { t: at(k), value }), at(k));
        }
        assert!(held.is_stuck(at(1_000)));
        assert_eq!(held.fresh(at(1_000), 0.01), None);
    }
}
