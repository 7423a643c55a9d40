//! Rows that a line is drawn through in a thinned recording: the plot of the run looks the same.
//!
//! A line goes through the smallest and the largest value of each fifth of a second, through the ends of gaps, and of a
//! stretch of equal values through its first and last row.

use crate::gaps::GapFinder;

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

    /// Picks the rows that stay: the smallest and the largest of each period (ns), those next to a gap and the
    /// not-a-number that marks it, and the first and the last.
    pub fn thin(&self, written: &[usize], period_ns: i64) -> Vec<usize> {
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

    /// Rows that stay of a line with rows every 20 ms in periods of 100 ms, with a value in every row.
    fn stay(line: &[f64]) -> Vec<usize> {
        rows_that_stay(line, 1, false)
    }

    /// Rows that stay of samples, `width` numbers a row.
    fn samples_stay(values: &[f64], width: usize) -> Vec<usize> {
        rows_that_stay(values, width, true)
    }

    fn rows_that_stay(values: &[f64], width: usize, sampled: bool) -> Vec<usize> {
        let chunk = LineChunk {
            time_ns: &every_20_ms(values.len() / width),
            values,
            width,
        };
        let written = chunk.written(&mut GapFinder::new(sampled));
        chunk.thin(&written, PERIOD_NS)
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
    fn a_smooth_line_goes_through_the_ends_of_each_period() {
        let ends: Vec<usize> = (0..500).filter(|i| matches!(i % 5, 0 | 4)).collect();
        assert_eq!(stay(&ramp()), ends);
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
        assert_eq!(stay(&[2.0; 500]), [0, 499]);
        let mut step = vec![1.0; 500];
        step[203..].fill(4.0);
        assert_eq!(stay(&step), [0, 200, 203, 499]);
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
