//! A score over one parameter, with all others fixed.

use crate::reports::plot::Figure;
use crate::reports::plot::axis::Axis;
use crate::reports::plot::line::{Line, LineChart};
use crate::reports::plot::theme::Ink;

/// Curves over one parameter.
#[derive(Clone, Debug)]
pub struct SensitivityChart {
    /// Title, such as the parameter's name.
    pub title: String,
    /// The parameter's axis.
    pub x: Axis,
    /// The score's axis.
    pub y: Axis,
    /// Curves, such as tuning and validation: name and points (parameter, score).
    pub curves: Vec<(String, Vec<(f64, f64)>)>,
    /// Values to mark, such as winner, default, published: name and value.
    pub marks: Vec<(String, f64)>,
}

impl SensitivityChart {
    /// Draw it.
    pub fn figure(self) -> Figure {
        let mut chart = LineChart::new(self.title, self.x, self.y);
        for (i, (name, points)) in self.curves.into_iter().enumerate() {
            let ink = Ink::series(i);
            chart.add(Line::new("", ink, points.clone()).dotted());
            chart.add(Line::new(name, ink, points));
        }
        let inks = [Ink::Good, Ink::Muted, Ink::Series(4), Ink::Series(5)];
        let marks = self.marks.into_iter().enumerate();
        chart.marks = marks
            .map(|(i, (name, at))| (name, at, inks[i % inks.len()]))
            .collect();
        chart.figure()
    }
}
