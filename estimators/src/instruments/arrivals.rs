//! Arrivals of the samples of a channel, and the time for which the last sample stays fresh.

use crate::api::snapshot::state;
use crate::tuning::{ARRIVALS, TIMES};
use crate::{Real, Time};

/// Arrivals of the samples of one channel: its last one is fresh for three mean gaps between arrivals and four mean
/// deviations of the gaps, and never for less than 0.1 s.
///
/// Mean and deviation are running ones over 16 gaps (the round-trip estimator of Jacobson 1988), so arrival jitter and
/// lost samples lengthen the timeout by what they do to the gaps, and a channel that comes evenly times out after three
/// periods. A gap counts for no more than the timeout, so that one dropout does not pass for a slow channel.
///
/// The timeout goes by the arrival of samples on the estimator's own clock; stamps of the sensor's clock only order the
/// samples. A sample that arrives after a younger one is late, and not to be taken.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Arrivals {
    stamp: Time,
    arrived: Time,
    gap_s: Real,
    deviation_s: Real,
    waited_s: Real,
}

impl Arrivals {
    /// Time between the last two samples, s.
    #[inline]
    pub fn waited_s(&self) -> Real {
        self.waited_s
    }

    /// Returns true if a sample with this stamp must be used, and notes its arrival. A sample not younger than the last
    /// is skipped, unless nothing younger has come for so long that the sensor's clock must have been set back.
    #[inline]
    pub fn take(&mut self, stamp: Time, now: Time, first: bool) -> bool {
        if !first {
            let gap = now.since(self.arrived);
            let set_back = stamp < self.stamp && gap > TIMES.mean_s;
            if !(stamp > self.stamp || set_back) {
                return false;
            }
            self.observe_gap(gap);
            self.waited_s = gap;
        }
        (self.stamp, self.arrived) = (stamp, now);
        true
    }

    #[inline]
    fn observe_gap(&mut self, gap: Real) {
        if self.gap_s <= 0.0 {
            self.gap_s = gap;
            return;
        }
        let away = gap.min(self.timeout_s()) - self.gap_s;
        self.gap_s += away / ARRIVALS.gap_memory;
        self.deviation_s += (away.abs() - self.deviation_s) / ARRIVALS.gap_memory;
    }

    #[inline]
    fn timeout_s(&self) -> Real {
        ARRIVALS.timeout_gaps * self.gap_s + ARRIVALS.timeout_deviations * self.deviation_s
    }

    /// Returns true if the last sample is still fresh.
    #[inline]
    pub fn fresh(&self, now: Time, dt_s: Real) -> bool {
        let age_s = now.since(self.arrived);
        age_s <= ARRIVALS.min_timeout_s
            || age_s <= self.timeout_s().max(ARRIVALS.timeout_gaps * dt_s) + 1e-9
    }
}

state!(Arrivals { stamp, arrived, gap_s, deviation_s, waited_s; });
