//! Arrival of samples: when, in which order, and which is handed over when several have arrived.
//!
//! A sample arrives at the instant it was taken plus the latency plus a time drawn from the arrival jitter, but not
//! before the one sent before it (a bus keeps the order); then it waits for the next multiple of the bunching time. A
//! share of the samples is held up on top of that, and others overtake it. Stamps stay as they are.

use super::sampling::to_ns;
use super::spec::{ArrivalJitter, DelayDistribution, Many, Sampling};
use super::stream::Stream;
use std::collections::VecDeque;

/// A sample on its way: the value as measured and the ideal one behind it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading<const N: usize> {
    /// Stamp, ns.
    pub stamp_ns: i64,
    /// The value as measured.
    pub measured: [f64; N],
    /// The ideal value, after the bandwidth of the instrument.
    pub ideal: [f64; N],
}

/// Samples on their way, ordered by the instant of their arrival. The memory is allocated once.
#[derive(Clone, Debug)]
pub struct DelayLine<const N: usize> {
    latency_ns: i64,
    jitter: Option<(ArrivalJitter, Stream)>,
    bunching_ns: i64,
    /// Share of delayed samples, their delay, and their random draws.
    reordering: Option<(f64, i64, Stream)>,
    many: Many,
    /// Arrival of the last sample sent, without reordering.
    last_ns: i64,
    queue: VecDeque<(i64, Reading<N>)>,
}

impl<const N: usize> DelayLine<N> {
    /// A line with room for every sample that can be on its way at once. `name` names the random streams.
    pub fn new(sampling: &Sampling, seed: u64, name: &str) -> Self {
        let jitter = sampling.arrival_jitter;
        let reordering = sampling.reordering;
        let longest_ms = sampling.latency_ms.get()
            + jitter.map_or(0.0, ArrivalJitter::longest_ms)
            + sampling.bunching_ms.get()
            + reordering.map_or(0.0, |r| r.delay_ms.get());
        // Kept below 2²⁰: a rate this absurd is refused by `check_step` before the first step.
        let room = (longest_ms * 1e-3 * sampling.rate_hz.get()).min(1e6) as usize + 4;
        Self {
            latency_ns: to_ns(sampling.latency_ms.get() * 1e-3),
            jitter: jitter.map(|j| (j, Stream::new(seed, &format!("{name}/arrival")))),
            bunching_ns: to_ns(sampling.bunching_ms.get() * 1e-3),
            reordering: reordering.map(|r| {
                let stream = Stream::new(seed, &format!("{name}/reordering"));
                (r.share.get(), to_ns(r.delay_ms.get() * 1e-3), stream)
            }),
            many: sampling.many,
            last_ns: i64::MIN,
            queue: VecDeque::with_capacity(room),
        }
    }

    /// Sends a reading that was taken at `taken_ns`.
    pub fn send(&mut self, taken_ns: i64, reading: Reading<N>) {
        if self.queue.len() == self.queue.capacity() {
            self.queue.pop_front(); // nothing is collected: drop the oldest rather than grow
        }
        let arrival_ns = self.arrival_ns(taken_ns);
        let after = self.queue.partition_point(|(ns, _)| *ns <= arrival_ns);
        self.queue.insert(after, (arrival_ns, reading));
    }

    /// Returns the reading that has arrived by `now_ns` since the last call: `None`, the only one, or the one that
    /// [`Many`] makes of several.
    pub fn receive(&mut self, now_ns: i64) -> Option<Reading<N>> {
        if self.queue.front().is_none_or(|(ns, _)| *ns > now_ns) {
            return None; // most steps bring nothing
        }
        let count = self.queue.partition_point(|(ns, _)| *ns <= now_ns);
        let arrived = || self.queue.iter().take(count).map(|(_, reading)| reading);
        let result = match (count, self.many) {
            (0 | 1, _) => arrived().next().copied(),
            (_, Many::Newest) => arrived().max_by_key(|r| r.stamp_ns).copied(),
            (_, Many::Mean) => Some(mean(arrived(), count)),
        };
        self.queue.drain(..count);
        result
    }

    fn arrival_ns(&mut self, taken_ns: i64) -> i64 {
        let mut arrival_ns = taken_ns + self.latency_ns;
        if let Some((jitter, stream)) = &mut self.jitter {
            let u = stream.uniform();
            let ms = match jitter.distribution {
                DelayDistribution::Uniform => jitter.ms.get() * u,
                DelayDistribution::Exponential => -jitter.ms.get() * libm::log(1.0 - u),
            };
            arrival_ns += to_ns(1e-3 * ms.min(jitter.longest_ms()));
        }
        arrival_ns = arrival_ns.max(self.last_ns);
        if self.bunching_ns > 0 {
            let over = arrival_ns.rem_euclid(self.bunching_ns);
            if over > 0 {
                arrival_ns += self.bunching_ns - over;
            }
        }
        self.last_ns = arrival_ns;
        if let Some((share, delay_ns, stream)) = &mut self.reordering
            && stream.uniform() < *share
        {
            arrival_ns += *delay_ns;
        }
        arrival_ns
    }
}

/// Mean of readings and of their stamps.
fn mean<'a, const N: usize>(
    readings: impl Iterator<Item = &'a Reading<N>>,
    count: usize,
) -> Reading<N> {
    let mut stamps = 0_i128;
    let (mut measured, mut ideal) = ([0.0; N], [0.0; N]);
    for r in readings {
        stamps += i128::from(r.stamp_ns);
        for i in 0..N {
            measured[i] += r.measured[i];
            ideal[i] += r.ideal[i];
        }
    }
    Reading {
        stamp_ns: (stamps / count as i128) as i64,
        measured: measured.map(|x| x / count as f64),
        ideal: ideal.map(|x| x / count as f64),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::checked::{Fraction, NonNegative, Positive};
    use crate::sensors::spec::Reordering;

    const MS: i64 = 1_000_000;

    fn uniform(ms: f64) -> ArrivalJitter {
        ArrivalJitter {
            distribution: DelayDistribution::Uniform,
            ms: Positive::new(ms),
        }
    }

    fn exponential(mean_ms: f64) -> ArrivalJitter {
        ArrivalJitter {
            distribution: DelayDistribution::Exponential,
            ms: Positive::new(mean_ms),
        }
    }

    fn reading(stamp_ns: i64) -> Reading<1> {
        Reading {
            stamp_ns,
            measured: [stamp_ns as f64],
            ideal: [0.0],
        }
    }

    /// Sends a sample every 10 ms for `count` of them, looks every ms; (instant, stamp) of what arrived.
    fn arrivals(sampling: Sampling, count: i64) -> Vec<(i64, i64)> {
        let mut line = DelayLine::new(&sampling, 3, "s");
        let mut seen = Vec::new();
        for ms in 0..count * 10 + 1000 {
            if ms % 10 == 0 && ms < count * 10 {
                line.send(ms * MS, reading(ms * MS));
            }
            if let Some(r) = line.receive(ms * MS) {
                seen.push((ms, r.stamp_ns / MS));
            }
        }
        seen
    }

    #[test]
    fn a_reading_arrives_after_the_latency_and_in_order() {
        let mut line = DelayLine::new(
            &Sampling {
                latency_ms: NonNegative::new(25.0),
                ..Sampling::at(100.0)
            },
            1,
            "s",
        );
        for k in 0..1000 {
            let now = k * 10_000_000;
            line.send(now, reading(now));
            assert!(line.receive(now + 4_999_999).is_none(), "{k}");
            let arrived = line.receive(now + 5_000_000).map(|r| r.stamp_ns);
            assert_eq!(arrived, (k >= 2).then_some(now - 20_000_000));
        }
    }

    #[test]
    fn a_line_nobody_empties_does_not_grow() {
        let mut line = DelayLine::new(&Sampling::at(100.0), 1, "s");
        let room = line.queue.capacity();
        for k in 0..1000 {
            line.send(k, reading(k));
        }
        assert_eq!(line.queue.capacity(), room);
        let left = line.queue.front().map(|(_, r)| r.stamp_ns);
        assert_eq!(left, Some(1000 - room as i64));
    }

    /// Delays below the period cannot make samples wait for each other: their distribution is the one asked for.
    #[test]
    fn delays_have_their_distribution() {
        let n = 40_000;
        let delays = |jitter| -> Vec<f64> {
            let mut line = DelayLine::<1>::new(
                &Sampling {
                    arrival_jitter: Some(jitter),
                    ..Sampling::at(100.0)
                },
                7,
                "s",
            );
            (0..n)
                .map(|k| (line.arrival_ns(k * 1000 * MS) - k * 1000 * MS) as f64 / MS as f64)
                .collect()
        };
        let bound = 5.0 / f64::sqrt(n as f64);
        let share =
            |x: &[f64], below: f64| x.iter().filter(|d| **d < below).count() as f64 / n as f64;
        let even = delays(uniform(50.0));
        for ms in [5.0, 25.0, 45.0] {
            assert!((share(&even, ms) - ms / 50.0).abs() < bound, "{ms}");
        }
        assert!(even.iter().all(|d| (0.0..=50.0).contains(d)));
        let rare = delays(exponential(20.0));
        for ms in [2.0_f64, 20.0, 80.0] {
            let expected = 1.0 - (-ms / 20.0).exp();
            assert!((share(&rare, ms) - expected).abs() < bound, "{ms}");
        }
        assert!(rare.iter().all(|d| *d <= 200.0));
    }

    /// A bus keeps the order however long one sample takes: newest stamps never fall, and none is lost.
    #[test]
    fn jitter_alone_keeps_the_order_and_loses_none() {
        let sampling = Sampling {
            arrival_jitter: Some(uniform(50.0)),
            many: Many::Newest,
            ..Sampling::at(100.0)
        };
        let seen = arrivals(sampling, 2000);
        assert!(seen.windows(2).all(|w| w[0].1 < w[1].1));
        assert!(
            seen.iter()
                .all(|(at, stamp)| (0..=51).contains(&(at - stamp)))
        );
        assert_eq!(seen.last().map(|s| s.1), Some(19_990));
        assert!(seen.len() < 1900, "some arrive together");
    }

    #[test]
    fn bunched_samples_arrive_at_multiples_as_their_mean() {
        let sampling = Sampling {
            bunching_ms: NonNegative::new(40.0),
            ..Sampling::at(100.0)
        };
        // Sent at 0; at 10, 20, 30, 40; at 50, 60, 70, 80; ….
        assert_eq!(
            arrivals(sampling, 13),
            [(0, 0), (40, 25), (80, 65), (120, 105)]
        );
    }

    /// A share of the samples comes so much later, behind younger ones; the others as ever.
    #[test]
    fn reordered_samples_are_overtaken() {
        let sampling = Sampling {
            reordering: Some(Reordering {
                share: Fraction::new(0.1),
                delay_ms: Positive::new(65.0),
            }),
            ..Sampling::at(100.0)
        };
        let n = 20_000;
        let seen = arrivals(sampling, n);
        assert_eq!(seen.len() as i64, n, "none is lost");
        let late = seen.iter().filter(|(at, stamp)| at - stamp == 65).count();
        assert!(
            seen.iter()
                .all(|(at, stamp)| [0, 65].contains(&(at - stamp)))
        );
        let share = late as f64 / n as f64;
        assert!(
            (share - 0.1).abs() < 5.0 * f64::sqrt(0.09 / n as f64),
            "{share}"
        );
        assert!(seen.windows(2).any(|w| w[1].1 < w[0].1));
    }

    #[test]
    fn of_many_the_newest_or_the_mean_is_handed_over() {
        for (many, stamp) in [(Many::Mean, 20 * MS), (Many::Newest, 30 * MS)] {
            let mut line = DelayLine::new(
                &Sampling {
                    many,
                    ..Sampling::at(100.0)
                },
                1,
                "s",
            );
            for k in 1..=3 {
                line.send(k * 10 * MS, reading(k * 10 * MS));
            }
            let seen = line.receive(30 * MS).unwrap();
            assert_eq!((seen.stamp_ns, seen.measured[0]), (stamp, stamp as f64));
            assert!(line.receive(40 * MS).is_none());
        }
    }
}
