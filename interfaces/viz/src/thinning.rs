//! Rows that a line is drawn through in a thinned recording: the plot of the run looks the same.
//!
//! A line with a value in every row goes through the first row of each tenth of a second, and through what stands out
//! between two of these. A line through samples, which are noise as a rule, goes through the smallest and the largest
//! of each fifth of a second. Both keep the ends of gaps, and of a stretch of equal values its first and last row.

use crate::gaps::GapFinder;

/// A row stands out if it is further outside of its neighbours on the line than this share of what the line spans in
/// the chunk.
const STANDS_OUT: f64 = 0.05;

/// Finds the first row of each period, chunk after chunk.
#[derive(Clone, Copy, Debug)]
pub struct Periods {
    period_ns: i64,
    last: Option<i64>,
}

impl Periods {
    /// Periods of this length, ns.
    pub fn new(period_ns: i64) -> Self {
        Self {
            period_ns,
            last: None,
        }
    }

    /// Marks the rows of the next chunk that are the first of their period.
    pub fn first_rows(&mut self, time_ns: &[i64]) -> Vec<bool> {
        let mut first = |ns: &i64| {
            let period = ns.div_euclid(self.period_ns);
            self.last.replace(period) != Some(period)
        };
        time_ns.iter().map(&mut first).collect()
    }
}

/// A chunk of a line: `width` numbers a row. Rows without a value are not numbers.
#[derive(Clone, Copy, Debug)]
pub struct LineChunk<'a> {
    /// Times of the rows, ns.
    pub time_ns: &'a [i64],
    /// Numbers of all rows, one row after the other.
    pub values: &'a [f64],
    /// Numbers a row.
    pub width: usize,
}

impl LineChunk<'_> {
    /// The rows that are drawn when nothing is thinned: those with a value, and the first of each gap.
    pub fn written(&self, gaps: &mut GapFinder) -> Vec<usize> {
        let rows = self.time_ns.iter().enumerate();
        rows.filter(|(row, ns)| gaps.keeps(**ns, self.has_value(*row)))
            .map(|(row, _)| row)
            .collect()
    }

    /// Picks the rows that stay of a line with a value in every row: the `first` of a period, those next to a gap and
    /// the not-a-number that marks it, and the largest and the smallest between two of these where they stand out.
    pub fn thin_line(&self, written: &[usize], first: &[bool]) -> Vec<usize> {
        let mut kept: Vec<bool> = (0..written.len())
            .map(|i| first[written[i]] || self.is_at_gap(written, i))
            .collect();
        for component in 0..self.width {
            self.keep_extremes(written, component, &mut kept);
        }
        let kept = written.iter().zip(kept).filter(|(_, kept)| *kept);
        self.without_inside_of_flats(kept.map(|(row, _)| *row).collect())
    }

    /// Picks the rows that stay of a line through samples: the smallest and the largest of each period (ns), those next
    /// to a gap and the not-a-number that marks it, and the first and the last.
    pub fn thin_samples(&self, written: &[usize], period_ns: i64) -> Vec<usize> {
        let mut kept = vec![false; written.len()];
        let low = |i: usize| self.at(written[i], 0);
        let high = |i: usize| self.at(written[i], self.width - 1);
        // smallest and largest of the period that goes on
        let mut of_period: Option<(i64, usize, usize)> = None;
        for (i, &row) in written.iter().enumerate() {
            kept[i] = i == 0 || i + 1 == written.len() || self.is_at_gap(written, i);
            if !self.has_value(row) {
                continue;
            }
            let period = self.time_ns[row].div_euclid(period_ns);
            of_period = match of_period {
                Some((same, least, most)) if same == period => {
                    let least = if low(i) < low(least) { i } else { least };
                    let most = if high(i) > high(most) { i } else { most };
                    Some((same, least, most))
                }
                over => {
                    if let Some((_, least, most)) = over {
                        (kept[least], kept[most]) = (true, true);
                    }
                    Some((period, i, i))
                }
            };
        }
        if let Some((_, least, most)) = of_period {
            (kept[least], kept[most]) = (true, true);
        }
        let kept = written.iter().zip(kept).filter(|(_, kept)| *kept);
        self.without_inside_of_flats(kept.map(|(row, _)| *row).collect())
    }

    fn at(&self, row: usize, component: usize) -> f64 {
        let place = row * self.width + component;
        self.values.get(place).copied().unwrap_or(f64::NAN)
    }

    fn row(&self, row: usize) -> &[f64] {
        let place = row * self.width;
        self.values
            .get(place..place + self.width)
            .unwrap_or_default()
    }

    fn has_value(&self, row: usize) -> bool {
        self.row(row).iter().all(|x| x.is_finite())
    }

    /// Returns whether a row that is written, or one beside it, marks a gap.
    fn is_at_gap(&self, written: &[usize], i: usize) -> bool {
        let near = written[i.saturating_sub(1)..].iter();
        let count = if i == 0 { 2 } else { 3 };
        near.take(count).any(|&row| !self.has_value(row))
    }

    /// Keeps the largest and the smallest value between two rows that are kept, where they stand out from both.
    fn keep_extremes(&self, written: &[usize], component: usize, kept: &mut [bool]) {
        let line = |i: usize| self.at(written[i], component);
        let finite = || (0..written.len()).map(line).filter(|x| x.is_finite());
        let (low, high) = (
            finite().fold(f64::INFINITY, f64::min),
            finite().fold(f64::NEG_INFINITY, f64::max),
        );
        if low >= high {
            return;
        }
        let room = STANDS_OUT * (high - low);
        let mut before: Option<usize> = None;
        for i in 0..=kept.len() {
            let end = i == kept.len();
            if !end && !kept[i] {
                continue;
            }
            if let Some(from) = before {
                // behind the last row that is kept there is only the one before
                let ends = [line(from), line(if end { from } else { i })];
                let between = || (from + 1..i).filter(|&k| line(k).is_finite());
                let by_value = |a: &usize, b: &usize| line(*a).total_cmp(&line(*b));
                let most = between().max_by(by_value);
                let least = between().min_by(by_value);
                if let Some(k) = most.filter(|&k| line(k) > ends[0].max(ends[1]) + room) {
                    kept[k] = true;
                }
                if let Some(k) = least.filter(|&k| line(k) < ends[0].min(ends[1]) - room) {
                    kept[k] = true;
                }
            }
            before = Some(i);
        }
    }

    /// Without rows that have the values of the row before and of the one behind them: the line through the others is
    /// the same.
    fn without_inside_of_flats(&self, rows: Vec<usize>) -> Vec<usize> {
        let is_inside = |i: usize| {
            let same =
                |other: Option<&usize>| other.is_some_and(|&o| self.row(o) == self.row(rows[i]));
            i > 0 && same(rows.get(i - 1)) && same(rows.get(i + 1))
        };
        let outside = (0..rows.len()).filter(|&i| !is_inside(i));
        outside.map(|i| rows[i]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_NS: i64 = 100_000_000;

    fn every_20_ms(rows: usize) -> Vec<i64> {
        (0..rows as i64).map(|i| 20_000_000 * i).collect()
    }

    /// Rows that stay of a line with rows every 20 ms in periods of 100 ms.
    fn stay(line: &[f64]) -> Vec<usize> {
        let time_ns = &every_20_ms(line.len())[..];
        let first = Periods::new(PERIOD_NS).first_rows(time_ns);
        let chunk = LineChunk {
            time_ns,
            values: line,
            width: 1,
        };
        let written = chunk.written(&mut GapFinder::new(false));
        chunk.thin_line(&written, &first)
    }

    /// Rows that stay of samples, `width` numbers a row.
    fn samples_stay(values: &[f64], width: usize) -> Vec<usize> {
        let chunk = LineChunk {
            time_ns: &every_20_ms(values.len() / width),
            values,
            width,
        };
        let written = chunk.written(&mut GapFinder::new(true));
        chunk.thin_samples(&written, PERIOD_NS)
    }

    fn ramp() -> Vec<f64> {
        (0..500).map(f64::from).collect()
    }

    /// Numbers without a pattern between -0.5 and 0.5.
    fn noise(n: usize) -> Vec<f64> {
        let mut random = monorig_testing::Random::new(1);
        (0..n).map(|_| random.unit() - 0.5).collect()
    }

    #[test]
    fn a_smooth_line_goes_through_the_first_row_of_each_period() {
        let tenths: Vec<usize> = (0..500).step_by(5).collect();
        assert_eq!(stay(&ramp()), tenths);
    }

    #[test]
    fn a_spike_of_one_row_stays_whichever_way_it_points() {
        for (row, size) in [(13, 40.0), (31, -40.0), (48, 30.0)] {
            let mut line = ramp();
            line[row] += size;
            assert!(stay(&line).contains(&row), "{row}");
        }
    }

    #[test]
    fn the_shortest_gap_stays_with_the_rows_beside_it() {
        let mut line = ramp();
        line[12] = f64::NAN;
        line[31..34].fill(f64::NAN);
        let stay = stay(&line);
        for row in [11, 12, 13, 30, 31, 34] {
            assert!(stay.contains(&row), "{row} of {stay:?}");
        }
        assert!(!stay.contains(&32));
    }

    /// The ends of both stretches of a step stay: no slope where there was none.
    #[test]
    fn a_stretch_of_equal_values_stays_as_its_ends() {
        assert_eq!(stay(&[2.0; 500]), [0, 495]);
        let mut step = vec![1.0; 500];
        step[203..].fill(4.0);
        assert_eq!(stay(&step), [0, 200, 205, 495]);
        assert_eq!(samples_stay(&step, 1), [0, 200, 203, 499]);
        assert_eq!(samples_stay(&[7.0; 500], 1), [0, 499]);
    }

    /// Periods go on from chunk to chunk.
    #[test]
    fn a_chunk_that_begins_within_a_period_has_no_first_row_there() {
        let mut periods = Periods::new(100);
        assert_eq!(periods.first_rows(&[0, 40, 80]), [true, false, false]);
        assert_eq!(periods.first_rows(&[90, 120, 160]), [false, true, false]);
    }

    /// A plot of noise shows its reach: in each period the same smallest and largest sample, in two fifths of the rows.
    #[test]
    fn samples_reach_as_far_in_every_period() {
        let all = noise(1000);
        let stay = samples_stay(&all, 1);
        for from in (0..1000).step_by(5) {
            let period = from..from + 5;
            let ends = |rows: &mut dyn Iterator<Item = usize>| {
                rows.map(|row| all[row])
                    .fold((1.0f64, -1.0f64), |(a, b), x| (a.min(x), b.max(x)))
            };
            let of_all = ends(&mut period.clone());
            let of_stay = ends(&mut stay.iter().copied().filter(|row| period.contains(row)));
            assert_eq!(of_stay, of_all, "{from}");
        }
        assert!(stay.len() <= 2 * 200 + 2, "{}", stay.len());
    }

    /// A band keeps the lowest of its lower and the highest of its upper edge.
    #[test]
    fn a_band_of_samples_keeps_both_edges() {
        let middle = noise(10);
        let band: Vec<f64> = middle.iter().flat_map(|x| [x - 2.0, x + 2.0]).collect();
        assert_eq!(samples_stay(&band, 2), samples_stay(&middle, 1));
    }

    /// Samples at 10 Hz in rows of 50 Hz: rows between two samples are no gap, half a second without is one, and what
    /// is beside it stays.
    #[test]
    fn a_gap_in_samples_stays() {
        let mut values = noise(500);
        let sampled = |row: usize| row.is_multiple_of(5) && !(200..260).contains(&row);
        (0..500)
            .filter(|row| !sampled(*row))
            .for_each(|row| values[row] = f64::NAN);
        let stay = samples_stay(&values, 1);
        let rows = every_20_ms(500);
        let mut gaps = GapFinder::new(true);
        let broken = (0..500).find(|&row| gaps.keeps(rows[row], sampled(row)) && !sampled(row));
        for row in [Some(195), broken, Some(260)] {
            assert!(row.is_some_and(|row| stay.contains(&row)), "{row:?}");
        }
        assert_eq!(stay.iter().filter(|row| !sampled(**row)).count(), 1);
    }
}
