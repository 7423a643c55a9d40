//! Is the stated uncertainty of a filter its real uncertainty? Normalised squares over time with their χ² band.

use crate::reports::plot::axis::Axis;
use crate::reports::plot::line::{Happening, Level, Line, LineChart};
use crate::reports::plot::{Figure, ValueGroup};

/// Normalised squared errors or innovations, one degree of freedom each.
#[derive(Clone, Debug)]
pub struct Consistency {
    /// Title.
    pub title: String,
    /// Title of the vertical axis, such as `NEES of the slope`.
    pub y: String,
    /// (time, value) of each filter.
    pub groups: Vec<ValueGroup<(f64, f64)>>,
    /// Number of samples in each shown mean; 1 = every sample. More only for values that are independent in time, as
    /// the innovations of a consistent filter are and its errors are not: else the band is too narrow.
    pub mean_of: usize,
    /// Faults and events on the way.
    pub happenings: Vec<Happening>,
}

/// Lower end of the axis, at which smaller values are drawn.
const LOWEST: f64 = 1e-3;

impl Consistency {
    /// Draw them: 95 % of the values of a consistent filter lie in the band.
    pub fn figure(self) -> Figure {
        let n = self.mean_of.max(1);
        let (low, high) = mean_square_band(n);
        let mut chart = LineChart::new(self.title, Axis::linear("time, s"), Axis::log(self.y));
        chart.levels = vec![
            Level::across("95 % of a consistent filter", low),
            Level::across("", high),
        ];
        chart.happenings = self.happenings;
        let mut shares = Vec::new();
        let mut top = high;
        for ValueGroup {
            name, ink, values, ..
        } in self.groups
        {
            let drawn = means_of(&values, n);
            let means = || drawn.iter().filter(|m| m.1.is_finite());
            let count = means().count();
            if count == 0 {
                continue;
            }
            let inside = means().filter(|m| (low..=high).contains(&m.1)).count();
            let share = 100.0 * inside as f64 / count as f64;
            shares.push(format!("{name}: {share:.0} %"));
            top = means().fold(top, |a, m| a.max(m.1));
            let shown = drawn.iter().map(|m| match m.1 {
                x if x.is_finite() => (m.0, x.max(LOWEST)),
                gap => (m.0, gap),
            });
            let shown = shown.collect();
            chart.add(Line::new(name, ink, shown));
        }
        let bottom = if n == 1 { LOWEST } else { low / 3.0 };
        chart.y = chart.y.between(bottom, (2.0 * top).min(1e4));
        if !shares.is_empty() {
            let what = if n == 1 {
                "samples".into()
            } else {
                format!("means of {n} samples")
            };
            chart.note = format!(
                "Share of {what} in the band: {}. The share is 95 % if the standard deviation is right, and more if it is too large.",
                shares.join(", ")
            );
        }
        chart.figure()
    }
}

/// Means over `n` values, computed for each stretch of finite values; with a gap between two stretches.
fn means_of(values: &[(f64, f64)], n: usize) -> Vec<(f64, f64)> {
    let mut out: Vec<(f64, f64)> = Vec::new();
    for stretch in values.chunk_by(|a, b| a.1.is_finite() == b.1.is_finite()) {
        match stretch.first() {
            Some((_, x)) if x.is_finite() => out.extend(stretch.chunks_exact(n).map(|c| {
                let mean = c.iter().map(|v| v.1).sum::<f64>() / n as f64;
                (c[c.len() / 2].0, mean)
            })),
            Some((t, gap)) => out.push((*t, *gap)),
            None => {}
        }
    }
    out
}

/// The middle 95 % of the mean of `n` independent squares of standard normal values: χ²ₙ quantiles over n. For one
/// value exact to the digits given, else by Wilson and Hilferty (1931), whose error is below 1 % from n = 10 on.
pub(crate) fn mean_square_band(n: usize) -> (f64, f64) {
    if n <= 1 {
        return (9.8207e-4, 5.0239);
    }
    let share = 2.0 / (9.0 * n as f64);
    let at = |z: f64| (1.0 - share + z * share.sqrt()).max(0.0).powi(3);
    (at(-1.959_964), at(1.959_964))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A value that is not a number breaks the line, and a mean is never of values on both sides of it.
    #[test]
    fn a_gap_stays_a_gap() {
        let gap = f64::NAN;
        let values = [1.0, 3.0, 5.0, gap, gap, 7.0, 9.0, gap]
            .into_iter()
            .enumerate();
        let values: Vec<(f64, f64)> = values.map(|(i, x)| (i as f64, x)).collect();
        let means = means_of(&values, 2);
        let shown: Vec<Option<f64>> = means
            .iter()
            .map(|m| Some(m.1).filter(|x| x.is_finite()))
            .collect();
        assert_eq!(shown, [Some(2.0), None, Some(8.0), None]);
        assert_eq!(means_of(&values, 1).len(), 7);
    }

    /// Tables of the χ² distribution: 2.5 % and 97.5 % for 10, 50 and 100 degrees of freedom.
    #[test]
    fn bands_are_those_of_the_tables() {
        for (n, low, high) in [
            (10, 3.247, 20.483),
            (50, 32.357, 71.420),
            (100, 74.222, 129.561),
        ] {
            let (a, b) = mean_square_band(n);
            let near = |x: f64, table: f64| (x * n as f64 / table - 1.0).abs() < 0.01;
            assert!(near(a, low) && near(b, high), "{n}: {a} {b}");
        }
    }
}
