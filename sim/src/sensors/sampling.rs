//! Schedule of the instants at which values are taken.
//!
//! A sensor of rate f is due at k/f, in whole nanoseconds computed from k each time: hours of run do not drift. The
//! value is *taken* at the due instant plus jitter, but *stamped* with the due instant. Lost samples never arrive.

use super::spec::Sampling;
use super::stream::Stream;

/// Seconds to whole nanoseconds.
pub fn to_ns(t_s: f64) -> i64 {
    libm::round(t_s * 1e9) as i64
}

/// Schedule of the instants at which values are taken.
#[derive(Clone, Debug)]
pub struct Schedule {
    rate_hz: f64,
    jitter_ns: f64,
    /// Largest jitter, which keeps the samples in order.
    jitter_limit_ns: f64,
    dropout: f64,
    jitter: Stream,
    loss: Stream,
    k: u64,
    next: SamplingInstant,
}

/// One instant of the schedule.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SamplingInstant {
    /// Stamp of the sample, ns.
    pub stamp_ns: i64,
    /// Instant at which the value is taken, ns.
    pub taken_ns: i64,
    /// True if the sample is lost on its way.
    pub lost: bool,
}

impl Schedule {
    /// A schedule that begins at 0.
    pub fn new(sampling: &Sampling, seed: u64, name: &str) -> Self {
        let rate_hz = sampling.rate_hz.get();
        let mut schedule = Self {
            rate_hz,
            jitter_ns: sampling.jitter_ms.get() * 1e6,
            jitter_limit_ns: 0.49e9 / rate_hz,
            dropout: sampling.dropout.get(),
            jitter: Stream::new(seed, &format!("{name}/jitter")),
            loss: Stream::new(seed, &format!("{name}/loss")),
            k: 0,
            next: SamplingInstant {
                stamp_ns: 0,
                taken_ns: 0,
                lost: false,
            },
        };
        schedule.plan(0);
        schedule
    }

    /// Samples per second, Hz.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Begins later: the next instant is the first multiple of the period at or after `start_ns`.
    pub fn begin_at(&mut self, start_ns: i64) {
        self.k = libm::floor(start_ns.max(0) as f64 * 1e-9 * self.rate_hz) as u64;
        while self.due_ns() < start_ns {
            self.k += 1;
        }
        self.plan(start_ns);
    }

    /// The instant at which the next value is taken, ns.
    pub fn next_ns(&self) -> i64 {
        self.next.taken_ns
    }

    /// Returns the next instant, and plans the following instant.
    pub fn take(&mut self) -> SamplingInstant {
        let now = self.next;
        self.k += 1;
        self.plan(now.taken_ns + 1);
        now
    }

    fn due_ns(&self) -> i64 {
        libm::round(self.k as f64 * 1e9 / self.rate_hz) as i64
    }

    fn plan(&mut self, not_before_ns: i64) {
        let stamp_ns = self.due_ns();
        let mut shift = 0.0;
        if self.jitter_ns > 0.0 {
            shift = (self.jitter_ns * self.jitter.normal())
                .clamp(-self.jitter_limit_ns, self.jitter_limit_ns);
        }
        self.next = SamplingInstant {
            stamp_ns,
            taken_ns: (stamp_ns + shift as i64).max(not_before_ns),
            lost: self.dropout > 0.0 && self.loss.uniform() < self.dropout,
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::checked::{Fraction, NonNegative};

    fn sampling(rate_hz: f64, jitter_ms: f64, dropout: f64) -> Sampling {
        Sampling {
            jitter_ms: NonNegative::new(jitter_ms),
            dropout: Fraction::new(dropout),
            ..Sampling::at(rate_hz)
        }
    }

    /// Ten hours at a rate whose period is no whole number of nanoseconds: exact integer arithmetic is the oracle.
    #[test]
    fn due_instants_do_not_drift() {
        for rate in [3_u64, 7, 30, 150, 200] {
            let mut schedule = Schedule::new(&sampling(rate as f64, 0.0, 0.0), 1, "s");
            for k in 0..36_000 * rate.min(30) {
                let exact =
                    (i128::from(k) * 2_000_000_000 + i128::from(rate)) / (2 * i128::from(rate));
                assert_eq!(
                    i128::from(schedule.take().stamp_ns),
                    exact,
                    "{rate} Hz, sample {k}"
                );
            }
        }
    }

    #[test]
    fn a_late_start_begins_at_the_next_multiple_of_the_period() {
        for (start, first) in [
            (0, 0),
            (1, 5_000_000),
            (5_000_000, 5_000_000),
            (5_000_001, 10_000_000),
        ] {
            let mut schedule = Schedule::new(&sampling(200.0, 0.0, 0.0), 1, "s");
            schedule.begin_at(start);
            assert_eq!(schedule.take().stamp_ns, first);
        }
    }

    #[test]
    fn jitter_has_its_spread_keeps_the_order_and_never_adds_up() {
        let mut schedule = Schedule::new(&sampling(100.0, 1.0, 0.0), 3, "s");
        let n = 100_000;
        let (mut last, mut squares, mut sum) = (-1, 0.0, 0.0);
        schedule.take(); // the first cannot be early: the run has not begun
        for k in 1..=n {
            let instant = schedule.take();
            assert_eq!(instant.stamp_ns, k * 10_000_000);
            assert!(instant.taken_ns > last);
            last = instant.taken_ns;
            let shift = (instant.taken_ns - instant.stamp_ns) as f64 * 1e-6;
            squares += shift * shift;
            sum += shift;
        }
        let n = n as f64;
        assert!((squares / n - 1.0).abs() < 5.0 * f64::sqrt(2.0 / n));
        assert!((sum / n).abs() < 5.0 / n.sqrt());
    }

    #[test]
    fn samples_are_lost_at_their_rate_and_independently() {
        let mut schedule = Schedule::new(&sampling(100.0, 0.0, 0.1), 4, "s");
        let n = 100_000;
        let lost: Vec<f64> = (0..n)
            .map(|_| f64::from(u8::from(schedule.take().lost)))
            .collect();
        let share = lost.iter().sum::<f64>() / n as f64;
        let twice = lost.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / n as f64;
        assert!(
            (share - 0.1).abs() < 5.0 * f64::sqrt(0.1 * 0.9 / n as f64),
            "{share}"
        );
        assert!(
            (twice - 0.01).abs() < 5.0 * f64::sqrt(0.01 / n as f64),
            "{twice}"
        );
    }
}
