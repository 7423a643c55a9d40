//! Sample and hold of sensor channels, with a timeout.

use crate::api::signals::Sample;
use crate::api::snapshot::state;
use crate::instruments::arrivals::Arrivals;
use crate::instruments::stuck_detector::StuckDetector;
use crate::{Real, Time};

/// Sample and hold of one instrument: its last sample, fresh for a time that follows from the gaps between its
/// samples, unless the sensor is stuck. Its `N` axes come in one sample, and each may be stuck by itself.
///
/// The timeout is three mean gaps between arrivals and four mean deviations of them, over 16 gaps, and never less than
/// 0.1 s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleHold<const N: usize> {
    arrivals: Arrivals,
    late: u32,
    value: Option<[Real; N]>,
    stuck: [StuckDetector<1>; N],
}

impl<const N: usize> Default for SampleHold<N> {
    fn default() -> Self {
        Self {
            arrivals: Arrivals::default(),
            late: 0,
            value: None,
            stuck: [StuckDetector::default(); N],
        }
    }
}

impl<const N: usize> SampleHold<N> {
    /// Takes a new sample and returns true if it was accepted. A sample not younger than the last one is skipped,
    /// unless nothing younger has come for so long that the sensor's clock must have been set back.
    #[inline]
    pub fn take(&mut self, sample: Option<Sample<[Real; N]>>, now: Time) -> bool {
        let Some(sample) = sample else { return false };
        if !self.arrivals.take(sample.t, now, self.value.is_none()) {
            self.late = self.late.saturating_add(1);
            return false;
        }
        if let Some(before) = self.value {
            let axes = sample.value.into_iter().zip(before);
            for (stuck, (value, before)) in self.stuck.iter_mut().zip(axes) {
                stuck.take([value], [before], now);
            }
        }
        self.value = Some(sample.value);
        true
    }

    /// Time from the previous sample to the held value, s.
    pub fn waited_s(&self) -> Real {
        self.arrivals.waited_s()
    }

    /// The held value, fresh or not.
    pub fn value(&self) -> Option<[Real; N]> {
        self.value
    }

    /// Returns true if an axis of the sensor is stuck.
    pub fn is_stuck(&self, now: Time) -> bool {
        self.stuck.iter().any(|stuck| stuck.is_stuck(now))
    }

    /// Each axis of the held value; `None` once it is stale or while that axis is stuck. `dt_s` is the estimator's
    /// step, the shortest period it can see.
    #[inline]
    pub fn fresh(&self, now: Time, dt_s: Real) -> [Option<Real>; N] {
        let mut fresh = [None; N];
        if let Some(value) = self.value.filter(|_| self.arrivals.fresh(now, dt_s)) {
            for ((fresh, value), stuck) in fresh.iter_mut().zip(value).zip(&self.stuck) {
                *fresh = Some(value).filter(|_| !stuck.is_stuck(now));
            }
        }
        fresh
    }
}

state!(@[const N: usize] SampleHold<N> { arrivals, late, value, stuck; });

#[cfg(test)]
mod tests {
    use super::*;

    fn at(t_s: f64, value: Real) -> Option<Sample<[Real; 1]>> {
        let (t, value) = (Time::from_s(t_s), [value]);
        Some(Sample { t, value })
    }

    #[test]
    fn a_value_is_fresh_for_three_periods() {
        let mut held = SampleHold::default();
        for k in 1..=10 {
            let t_s = 0.05 * f64::from(k);
            assert!(held.take(at(t_s, 1.0), Time::from_s(t_s)));
        }
        assert_eq!(held.fresh(Time::from_s(0.65), 0.01), [Some(1.0)]);
        assert_eq!(held.fresh(Time::from_s(0.66), 0.01), [None]);
    }

    #[test]
    fn a_dropout_does_not_pass_for_a_slow_channel() {
        let mut held = SampleHold::default();
        for t_s in [0.0, 0.1, 0.2, 5.0] {
            held.take(at(t_s, 1.0), Time::from_s(t_s));
        }
        // The gap counts for 0.3 s: mean 0.1 + 0.2/16, deviation 0.2/16.
        let timeout_s = 3.0 * (0.1 + 0.2 / 16.0) + 4.0 * 0.2 / 16.0;
        assert_eq!(
            held.fresh(Time::from_s(5.0 + timeout_s - 0.001), 0.01),
            [Some(1.0)]
        );
        assert_eq!(
            held.fresh(Time::from_s(5.0 + timeout_s + 0.001), 0.01),
            [None]
        );
    }

    /// Share of the time after the first second that the channel is stale: samples every `period` s, each `delay` s
    /// late, the earlier of them lost.
    fn stale_share(period: f64, mut delay: impl FnMut() -> Option<f64>) -> (f64, SampleHold<1>) {
        let step = 0.005;
        let mut held = SampleHold::default();
        let count = (60.0 / period) as usize;
        let mut under_way: std::vec::Vec<(f64, f64)> = (0..count)
            .filter_map(|k| Some((period * k as f64 + delay()?, period * k as f64)))
            .collect();
        under_way.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut next, mut stale) = (0, 0);
        for k in 1..11_000 {
            let now = step * f64::from(k);
            while next < under_way.len() && under_way[next].0 <= now {
                let (_, stamp) = under_way[next];
                held.take(at(stamp, now), Time::from_s(now));
                next += 1;
            }
            let none = held.fresh(Time::from_s(now), step as Real) == [None];
            stale += u32::from(now > 1.0 && none);
        }
        (f64::from(stale) / 10_800.0, held)
    }

    #[test]
    fn jitter_loss_and_reordering_do_not_make_a_channel_stale() {
        use crate::testing::Random;
        for (seed, period) in [(1, 0.005), (2, 0.01), (3, 0.05)] {
            let mut random = Random::new(seed);
            let (stale, held) = stale_share(period, || Some(0.05 * random.uniform()));
            assert_eq!(stale, 0.0, "jitter at {period} s");
            assert!(period > 0.02 || held.late > 0);
            let (stale, _) = stale_share(period, || Some(0.0).filter(|_| random.uniform() > 0.2));
            // At 20 Hz five samples in a row, a quarter of a second, are lost now and then.
            let most = if period > 0.02 { 0.003 } else { 0.0 };
            assert!(stale <= most, "loss at {period} s: {stale}");
            let late = |random: &mut Random| if random.uniform() < 0.1 { 0.06 } else { 0.0 };
            let (stale, _) = stale_share(period, || Some(late(&mut random)));
            assert_eq!(stale, 0.0, "reordering at {period} s");
        }
    }

    #[test]
    fn an_older_stamp_is_skipped_until_the_clock_must_have_been_set_back() {
        let mut held = SampleHold::default();
        assert!(held.take(at(100.0, 1.0), Time::from_s(100.0)));
        assert!(!held.take(at(100.0, 2.0), Time::from_s(100.1)));
        assert!(!held.take(at(3.0, 2.0), Time::from_s(100.5)));
        assert!(held.take(at(3.5, 2.0), Time::from_s(101.5)));
        assert_eq!(held.fresh(Time::from_s(101.5), 0.01), [Some(2.0)]);
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
            held.take(
                Some(Sample {
                    t: at(k),
                    value: [value],
                }),
                at(k),
            );
        }
        assert!(held.is_stuck(at(1_000)));
        assert_eq!(held.fresh(at(1_000), 0.01), [None]);
    }

    /// Three axes in one sample are held as three channels would be, each with its own stuck detector.
    #[test]
    fn axes_of_one_sample_are_held_like_channels() {
        let mut random = crate::testing::Random::new(93);
        let mut vector = SampleHold::<3>::default();
        let mut channels = [SampleHold::<1>::default(); 3];
        let mut stuck = 0;
        for k in 0..2_000_i64 {
            let now = Time::from_ns(10_000_000 * k);
            let t = Time::from_ns(now.ns() - (30_000_000.0 * random.uniform()) as i64);
            let y = if k < 900 { random.normal() } else { 0.7 };
            let value = [random.normal(), y, random.normal()];
            let lost = random.uniform() < 0.2 || (1_500..1_600).contains(&k);
            let sample = (!lost).then_some(Sample { t, value });
            let taken = vector.take(sample, now);
            let each = channels.iter_mut().zip(value);
            for (channel, value) in each {
                assert_eq!(
                    channel.take(sample.map(|_| Sample { t, value: [value] }), now),
                    taken
                );
            }
            let fresh = vector.fresh(now, 0.01);
            assert_eq!(fresh, channels.each_ref().map(|c| c.fresh(now, 0.01)[0]));
            stuck += u32::from(fresh[1].is_none() && fresh[0].is_some());
        }
        let [first, ..] = channels;
        assert_eq!(vector.arrivals, first.arrivals);
        assert!(stuck > 500 && vector.value().is_some());
    }

    #[test]
    fn what_is_held_how_often_it_comes_and_what_came_late() {
        let mut held = SampleHold::default();
        assert_eq!((held.value, held.arrivals.waited_s()), (None, 0.0));
        for k in 0..400 {
            let t_s = 0.04 * f64::from(k);
            held.take(at(t_s, 2.0), Time::from_s(t_s));
        }
        assert_eq!((held.value, held.late), (Some([2.0]), 0));
        assert!((held.arrivals.waited_s() - 0.04).abs() < 1e-6);
        for k in 1..=2 {
            assert!(!held.take(at(15.0, 9.0), Time::from_s(15.97)));
            assert_eq!((held.value, held.late), (Some([2.0]), k));
        }
    }

    /// Gaps of 0.02 and 0.06 s by turns: their mean is 0.04 s, their mean deviation 0.02 s, the timeout 3 · 0.04 + 4 ·
    /// 0.02 s.
    #[test]
    fn the_timeout_is_three_mean_gaps_and_four_mean_deviations() {
        let mut held = SampleHold::default();
        let mut t_s = 0.0;
        for k in 0..401 {
            t_s += if k % 2 == 0 { 0.02 } else { 0.06 };
            held.take(at(t_s, 1.0), Time::from_s(t_s));
        }
        assert!(held.fresh(Time::from_s(t_s + 0.19), 0.01)[0].is_some());
        assert!(held.fresh(Time::from_s(t_s + 0.21), 0.01)[0].is_none());
    }
}
