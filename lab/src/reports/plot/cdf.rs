//! Empirical distribution functions: what share of values is at most so large.

use crate::reports::plot::axis::{Axis, common_range};
use crate::reports::plot::line::{Line, LineChart};
use crate::reports::plot::{Figure, ValueGroup};

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
    /// Draws the functions, up to the largest of the 99.5 % quantiles; a kind of values with a much larger range than
    /// the others is cut off.
    pub fn figure(self) -> Figure {
        let mut ends = Vec::new();
        let mut chart = LineChart::new(self.title, self.x, Axis::linear("share of values, %"));
        chart.y = chart.y.between(0.0, 103.0);
        for group in self.groups {
            let mut values = group.values;
            values.retain(|x| x.is_finite());
            values.sort_unstable_by(f64::total_cmp);
            let last = values.len().saturating_sub(1);
            if let (Some(&a), Some(&b)) = (values.first(), values.get(last * 199 / 200)) {
                ends.push((a, b));
            }
            let share = |i: usize| 100.0 * (i + 1) as f64 / values.len() as f64;
            let points = values.iter().enumerate().map(|(i, &x)| (x, share(i)));
            chart.add(Line::new(group.name, group.ink, points.collect()));
        }
        if let Some(((a, b), cut)) = common_range(&ends)
            && chart.x.range.is_none()
            && b > a
        {
            chart.x.range = Some((a, b));
            if cut {
                chart.note = "Lines are cut at the end of the axis.".into();
            }
        }
        chart.figure()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reports::plot::theme::Ink;

    #[test]
    fn one_kind_that_is_far_off_does_not_flatten_the_others() {
        let good = |k: usize| {
            let values = (1..=200).map(|i| f64::from(i) * 0.005).collect();
            ValueGroup::new(format!("good {k}"), Ink::series(k), values)
        };
        let far: Vec<f64> = (1..=200).map(f64::from).collect();
        let figure = |groups| {
            let (title, x) = ("t".into(), Axis::linear("x"));
            Cdf { title, x, groups }.figure()
        };
        let alone = figure(vec![good(0), good(1)]);
        assert_eq!(alone.note, "");
        let with_bad = figure(vec![
            good(0),
            good(1),
            ValueGroup::new("bad", Ink::series(2), far),
        ]);
        assert!(with_bad.note.starts_with("Lines are cut"));
        // the axis goes to four times what is usual, not to 199
        assert!(!with_bad.svg.unwrap().contains(">100<"));
    }
}
