//! Which rows a line is drawn through in a thinned recording: the first of each period, the ends of gaps, and what stands out.

/// A row stands out if it is further outside of its neighbours on the line than this share of what the line spans in the chunk.
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

    /// Which rows of the next chunk are the first of their period.
    pub fn first_rows(&mut self, time_ns: &[i64]) -> Vec<bool> {
        let mut first = |ns: &i64| {
            let period = ns.div_euclid(self.period_ns);
            self.last.replace(period) != Some(period)
        };
        time_ns.iter().map(&mut first).collect()
    }
}

/// Takes rows of a line out of `written`: what stays are the rows that are `first` of a period, those next to a gap and the not-a-number that
/// marks it, and the largest and the smallest between two of these where they stand out.
///
/// `values` has `width` numbers a row; rows without a value are not numbers.
pub fn thin(values: &[f64], width: usize, first: &[bool], written: &mut [bool]) {
    let gap = |row: usize| values.get(row * width).is_some_and(|x| x.is_nan());
    let mut kept: Vec<bool> = (0..written.len())
        .map(|i| written[i] && (first[i] || gap(i) || (i > 0 && gap(i - 1)) || gap(i + 1)))
        .collect();
    for component in 0..width {
        let line: Vec<f64> = values[component..].iter().step_by(width).copied().collect();
        keep_extremes(&line, written, &mut kept);
    }
    written.copy_from_slice(&kept);
}

/// Keeps the largest and the smallest value between two rows that are kept, where they stand out from both.
fn keep_extremes(line: &[f64], written: &[bool], kept: &mut [bool]) {
    let finite = || line.iter().copied().filter(|x| x.is_finite());
    let (low, high) = (
        finite().fold(f64::INFINITY, f64::min),
        finite().fold(f64::NEG_INFINITY, f64::max),
    );
    if low >= high {
        return;
    }
    let room = STANDS_OUT * (high - low);
    let mut before: Option<usize> = None;
    for row in 0..=kept.len() {
        let end = row == kept.len();
        if !end && !kept[row] {
            continue;
        }
        if let Some(from) = before {
            // behind the last row that is kept there is only the one before
            let ends = [line[from], if end { line[from] } else { line[row] }];
            let between = || (from + 1..row).filter(|&i| written[i] && line[i].is_finite());
            let by_value = |a: &usize, b: &usize| line[*a].total_cmp(&line[*b]);
            let most = between().max_by(by_value);
            let least = between().min_by(by_value);
            if let Some(i) = most.filter(|&i| line[i] > ends[0].max(ends[1]) + room) {
                kept[i] = true;
            }
            if let Some(i) = least.filter(|&i| line[i] < ends[0].min(ends[1]) - room) {
                kept[i] = true;
            }
        }
        before = Some(row);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows that stay of a line with rows every 20 ms in periods of 100 ms, and no row that a gap leaves out.
    fn stay(line: &[f64]) -> Vec<usize> {
        let ns: Vec<i64> = (0..line.len() as i64).map(|i| 20_000_000 * i).collect();
        let first = Periods::new(100_000_000).first_rows(&ns);
        let mut gaps = crate::gaps::GapFinder::new(false);
        let rows = ns.iter().zip(line);
        let mut written: Vec<bool> = rows.map(|(ns, x)| gaps.keeps(*ns, x.is_finite())).collect();
        thin(line, 1, &first, &mut written);
        (0..line.len()).filter(|&i| written[i]).collect()
    }

    fn ramp() -> Vec<f64> {
        (0..500).map(f64::from).collect()
    }

    #[test]
    fn a_smooth_line_goes_through_the_first_row_of_each_period() {
        let tenths: Vec<usize> = (0..500).step_by(5).collect();
        assert_eq!(stay(&ramp()), tenths);
        assert_eq!(stay(&[2.0; 500]), tenths);
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

    /// Periods go on from chunk to chunk.
    #[test]
    fn a_chunk_that_begins_within_a_period_has_no_first_row_there() {
        let mut periods = Periods::new(100);
        assert_eq!(periods.first_rows(&[0, 40, 80]), [true, false, false]);
        assert_eq!(periods.first_rows(&[90, 120, 160]), [false, true, false]);
    }
}
