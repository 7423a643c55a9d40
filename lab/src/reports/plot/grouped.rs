//! Bars side by side: values of several series for each of a few names.

use crate::reports::plot::axis::Axis;
use crate::reports::plot::canvas;
use crate::reports::plot::theme::Ink;
use crate::reports::plot::{Figure, Look, ValueGroup, legend};

/// Bars in groups.
#[derive(Clone, Debug)]
pub(crate) struct GroupedBars {
    pub(crate) title: String,
    /// Note for the reader.
    pub(crate) note: String,
    /// Names of the groups, below the drawing.
    pub(crate) names: Vec<String>,
    /// Axis of the values. Bars are cut where they leave it.
    pub(crate) y: Axis,
    /// Series, each with a value for every name; a value that is not finite has no bar.
    pub(crate) series: Vec<ValueGroup<f64>>,
}

/// Share of a group's width for its bars.
const FILLED: f64 = 0.8;

impl GroupedBars {
    /// Draw it.
    pub(crate) fn figure(self) -> Figure {
        let values = self.series.iter().flat_map(|s| s.values.iter().copied());
        let finite: Vec<f64> = values.filter(|x| x.is_finite()).collect();
        let y = match finite.is_empty() {
            true => None,
            false => self.y.fix(finite.iter().copied().chain([0.0]), 0.06),
        };
        let x = Axis::names("", self.names.clone()).fix([0.0].into_iter(), 0.0);
        let svg = canvas::draw(x, y, |c| {
            let width = FILLED / self.series.len().max(1) as f64;
            for (i, series) in self.series.iter().enumerate() {
                for (k, value) in series.values.iter().enumerate() {
                    let left = k as f64 - 0.5 * FILLED + i as f64 * width;
                    c.rectangle((left, 0.0), (left + 0.9 * width, *value), series.ink, 0.9);
                }
            }
            c.level(0.0, canvas::across(), Ink::Text, 2);
        });
        let keys = legend(&self.series, Look::Area);
        Figure::new(self.title, self.note, svg, keys)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_for_each_finite_value() {
        let bars = |values: Vec<f64>| GroupedBars {
            title: "t".into(),
            note: String::new(),
            names: vec!["a".into(), "b".into()],
            y: Axis::linear("y"),
            series: vec![ValueGroup::new("s", Ink::Series(0), values)],
        };
        let count = |values| {
            let svg = bars(values).figure().svg;
            svg.map(|svg| svg.matches("<rect").count())
        };
        let (two, one) = (
            count(vec![1.0, -2.0]).unwrap(),
            count(vec![1.0, f64::NAN]).unwrap(),
        );
        assert_eq!(two, one + 1);
        assert!(count(vec![f64::NAN, f64::NAN]).is_none());
    }
}
