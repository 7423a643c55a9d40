//! Empirical distribution functions: what share of values is at most so large.

use crate::plot::axis::Axis;
use crate::plot::line::{Line, LineChart};
use crate::plot::{Figure, ValueGroup};

/// Empirical distribution functions.
#[derive(Clone, Debug)]
pub struct Cdf {
    /// Title.
    pub title: String,
    /// Axis of the values.
    pub x: Axis,
    /// Values of each kind.
    pub groups: Vec<ValueGroup<f64>>,
}

impl Cdf {
    /// Draw them, up to the largest of the 99.5 % quantiles.
    pub fn figure(self) -> Figure {
        let mut ends: Option<(f64, f64)> = None;
        let mut chart = LineChart::new(self.title, self.x, Axis::linear("share of values, %"));
        chart.y = chart.y.between(0.0, 103.0);
        for group in self.groups {
            let mut values = group.values;
            values.retain(|x| x.is_finite());
            values.sort_unstable_by(f64::total_cmp);
            let last = values.len().saturating_sub(1);
            if let (Some(&a), Some(&b)) = (values.first(), values.get(last * 199 / 200)) {
                ends = Some(ends.map_or((a, b), |e| (e.0.min(a), e.1.max(b))));
            }
            let share = |i: usize| 100.0 * (i + 1) as f64 / values.len() as f64;
            let points = values.iter().enumerate().map(|(i, &x)| (x, share(i)));
            chart
                .lines
                .push(Line::new(group.name, group.ink, points.collect()));
        }
        if let Some((a, b)) = ends
            && chart.x.range.is_none()
            && b > a
        {
            chart.x.range = Some((a, b));
        }
        chart.figure()
    }
}
