//! Breaks in lines: a viewer joins neighbouring rows with a straight line, so a gap needs a row that is not a number.

/// Gaps of sampled channels up to this length are the time between two samples, ns.
const SHORT_GAP_NS: i64 = 250_000_000;
/// Longest distance of two samples that is no gap, as a multiple of the shortest distance.
const SAMPLE_INTERVALS: i64 = 5;

/// Finds the rows of one line that are drawn, and those at which it breaks, chunk after chunk.
#[derive(Clone, Debug, Default)]
pub struct GapFinder {
    /// Rows without a value are normal between two samples.
    sampled: bool,
    last_ns: Option<i64>,
    shortest_ns: Option<i64>,
    broken: bool,
}

impl GapFinder {
    /// Makes a detector for a line whose channel is `sampled` less often than there are rows, or has a value in every
    /// row.
    pub fn new(sampled: bool) -> Self {
        Self {
            sampled,
            ..Self::default()
        }
    }

    /// Returns whether the row at `time_ns` is written: all rows with a value, and the first of a gap.
    pub fn keeps(&mut self, time_ns: i64, has_value: bool) -> bool {
        if has_value {
            if let Some(last) = self.last_ns {
                let interval = time_ns - last;
                self.shortest_ns = Some(self.shortest_ns.map_or(interval, |s| s.min(interval)));
            }
            self.last_ns = Some(time_ns);
            self.broken = false;
            return true;
        }
        let Some(last) = self.last_ns.filter(|_| !self.broken) else {
            return false;
        };
        let between_samples = match (self.sampled, self.shortest_ns) {
            (false, _) => 0,
            (true, None) => i64::MAX,
            (true, Some(shortest)) => SHORT_GAP_NS.max(shortest.saturating_mul(SAMPLE_INTERVALS)),
        };
        self.broken = time_ns - last > between_samples;
        self.broken
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Times (ms) that are kept of rows every 20 ms, of which those in `values` (ms) have a value.
    fn kept(sampled: bool, values: impl Fn(i64) -> bool) -> Vec<i64> {
        let mut gaps = GapFinder::new(sampled);
        let rows = (0..100).map(|i| 20 * i);
        rows.filter(|&ms| gaps.keeps(ms * 1_000_000, values(ms)))
            .collect()
    }

    #[test]
    fn a_gap_breaks_the_line_once_and_at_its_start() {
        let kept = kept(false, |ms| !(100..1000).contains(&ms));
        assert_eq!(kept[4..7], [80, 100, 1000]);
        assert_eq!(kept.len(), 5 + 1 + 50);
    }

    /// 10 Hz in rows of 50 Hz: no gap; half a second without a sample is one.
    #[test]
    fn the_time_between_two_samples_is_no_gap() {
        let all = kept(true, |ms| ms % 100 == 0);
        assert_eq!(all.len(), 20);
        let hole = kept(true, |ms| ms % 100 == 0 && !(500..1500).contains(&ms));
        let breaks: Vec<_> = hole.iter().filter(|ms| *ms % 100 != 0).collect();
        assert_eq!(breaks, [&920], "500 ms after the last sample at 400 ms");
    }

    #[test]
    fn nothing_before_the_first_value() {
        assert_eq!(kept(false, |_| false), [0; 0]);
        assert_eq!(kept(false, |ms| ms == 1980), [1980]);
    }
}
