//! Figures of the samples of a channel: how many, how regular, how many of them count, how long it repeats a value, and
//! how many are at an end of the range.

/// Steps of time that are kept to find their median.
const KEPT: usize = 100_000;
/// A step this many times the median is a gap.
const GAP: i64 = 5;
/// A time without a sample that no estimator bridges, ns.
const SILENT_NS: i64 = 2_000_000_000;

/// Figures of the samples of a channel.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stamps {
    /// Numbers of samples in the log, and of usable samples.
    pub offered: u64,
    pub accepted: u64,
    /// Samples with the stamp of the one before; those of them whose value is another.
    pub duplicates: u64,
    pub contradicting: u64,
    /// Time between samples that are not further apart than [`SILENT_NS`], ns.
    pub covered_ns: i64,
    /// Longest time for which one value that is not zero was repeated, ns, and when it began; the longest of the other
    /// times.
    pub longest_ns: i64,
    pub longest_from_ns: i64,
    pub second_ns: i64,
    /// Ranges of its columns, as the log has them.
    pub ranges: [ColumnRange; 3],
    last_ns: i64,
    steps: Vec<i64>,
    /// A value that is repeated, and the first and last time of it.
    run: Option<([f64; 3], i64, i64)>,
}

impl Stamps {
    /// Takes a sample of the log: its stamp, ns, its value if it counts, and that of its columns.
    pub fn see(&mut self, t_ns: i64, value: Option<[f64; 3]>, columns: [f64; 3]) {
        if self.offered > 0 {
            let step = t_ns.saturating_sub(self.last_ns);
            self.duplicates += u64::from(step == 0);
            let another = self.run.is_some_and(|(last, ..)| Some(last) != value);
            self.contradicting += u64::from(step == 0 && value.is_some() && another);
            if step <= SILENT_NS {
                self.covered_ns += step.max(0);
            }
            if self.steps.len() < KEPT && step > 0 {
                self.steps.push(step);
            }
        }
        self.offered += 1;
        self.last_ns = t_ns;
        let Some(value) = value else {
            return;
        };
        self.accepted += 1;
        for (range, x) in self.ranges.iter_mut().zip(columns) {
            if !x.is_nan() {
                range.push(x);
            }
        }
        match &mut self.run {
            Some((same, _, until)) if *same == value => *until = t_ns,
            _ => {
                self.end_run();
                self.run = Some((value, t_ns, t_ns));
            }
        }
    }

    /// The repetition of a value is over.
    fn end_run(&mut self) {
        if let Some((value, from_ns, until_ns)) = self.run.take()
            && value != [0.0; 3]
        {
            let length = until_ns.saturating_sub(from_ns);
            if length > self.longest_ns {
                self.second_ns = self.longest_ns;
                (self.longest_ns, self.longest_from_ns) = (length, from_ns);
            } else {
                self.second_ns = self.second_ns.max(length);
            }
        }
    }

    /// The log is over: the figures of its rate.
    pub fn rate(&mut self) -> Rate {
        self.end_run();
        let mut sorted = self.steps.clone();
        sorted.sort_unstable();
        let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0);
        let (regular, gaps): (Vec<i64>, Vec<i64>) =
            sorted.iter().partition(|s| **s <= GAP * median);
        let n = regular.len().max(1) as f64;
        let mean = regular.iter().map(|s| *s as f64).sum::<f64>() / n;
        let squares = regular.iter().map(|s| (*s as f64 - mean).powi(2));
        Rate {
            rate_hz: 1e9 / median as f64,
            jitter_ms: (squares.sum::<f64>() / n).sqrt() * 1e-6,
            gaps: gaps.len() as u64,
            longest_gap_s: gaps.last().map_or(0.0, |s| *s as f64 * 1e-9),
        }
    }
}

/// The range of a column.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ColumnRange {
    pub n: u64,
    min: f64,
    max: f64,
    at_min: u64,
    at_max: u64,
}

impl ColumnRange {
    fn push(&mut self, x: f64) {
        if self.n == 0 || x < self.min {
            (self.min, self.at_min) = (x, 0);
        }
        if self.n == 0 || x > self.max {
            (self.max, self.at_max) = (x, 0);
        }
        self.n += 1;
        self.at_min += u64::from(x == self.min);
        self.at_max += u64::from(x == self.max);
    }

    /// True if it never changes.
    pub fn is_constant(&self) -> bool {
        self.n > 1 && self.min == self.max
    }

    /// Share of the samples exactly at an end of the range, the larger of the two shares; an end at zero (a standing
    /// vehicle) does not count.
    pub fn at_an_end(&self) -> f64 {
        let of = |end: f64, count: u64| if end == 0.0 { 0 } else { count };
        of(self.min, self.at_min).max(of(self.max, self.at_max)) as f64 / self.n.max(1) as f64
    }
}

/// Rate of a channel: by the median step, with the standard deviation of the steps that are no gaps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rate {
    pub rate_hz: f64,
    pub jitter_ms: f64,
    pub gaps: u64,
    pub longest_gap_s: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 100 Hz for 10 s, one gap of a second, one stamp twice, every fourth sample rejected, one value for 3 s.
    #[test]
    fn figures_are_what_was_planted() {
        let mut stamps = Stamps::default();
        for i in 0..1000_i32 {
            let t_ns = i64::from(i) * 10_000_000 + if i >= 500 { 1_000_000_000 } else { 0 };
            let x = if (600..900).contains(&i) {
                7.0
            } else {
                f64::from(i)
            };
            stamps.see(
                t_ns,
                (i % 4 != 0).then_some([x, 0.0, 0.0]),
                [x.min(950.0); 3],
            );
            if i == 10 {
                stamps.see(t_ns, None, [0.0; 3]);
                stamps.see(t_ns, Some([0.5, 0.0, 0.0]), [0.5; 3]);
            }
            if i == 999 {
                stamps.see(t_ns + 3 * SILENT_NS, None, [0.0; 3]);
            }
        }
        let rate = stamps.rate();
        assert!((rate.rate_hz - 100.0).abs() < 1e-9 && rate.jitter_ms < 1e-9);
        assert_eq!((rate.gaps, rate.longest_gap_s), (2, 6.0));
        assert_eq!((stamps.offered, stamps.accepted), (1003, 751));
        assert_eq!((stamps.duplicates, stamps.contradicting), (2, 1));
        // all but the six seconds at the end, which are beyond what is bridged
        assert_eq!(stamps.covered_ns, 999 * 10_000_000 + 1_000_000_000);
        // from the first that counts to the last: 601 to 899
        assert_eq!(stamps.longest_ns, 2_980_000_000);
        assert!(stamps.second_ns < 20_000_000);
        // cut off at 950: of the last fifty three quarters count, and that at 950 itself is one of the rejected or not
        let clipped = (950..1000).filter(|i| i % 4 != 0).count();
        assert_eq!(stamps.ranges[0].at_an_end(), clipped as f64 / 751.0);
    }
}
