//! Points in a plane: one quantity against another.

use crate::reports::plot::axis::Axis;
use crate::reports::plot::canvas;
use crate::reports::plot::{Figure, LegendEntry, Look, ValueGroup};

/// A scatter plot.
#[derive(Clone, Debug)]
pub struct Scatter {
    pub(crate) title: String,
    /// Note for the reader.
    pub(crate) note: String,
    /// Horizontal axis.
    pub(crate) x: Axis,
    /// Vertical axis.
    pub(crate) y: Axis,
    /// Points.
    pub groups: Vec<ValueGroup<(f64, f64)>>,
    /// Lines over them.
    pub(crate) lines: Vec<ValueGroup<(f64, f64)>>,
}

impl Scatter {
    /// An empty plot.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Self {
        Self {
            title: title.into(),
            note: String::new(),
            x,
            y,
            groups: Vec::new(),
            lines: Vec::new(),
        }
    }

    /// Draw it.
    pub fn figure(self) -> Figure {
        let all = || {
            self.groups
                .iter()
                .chain(&self.lines)
                .flat_map(|g| &g.values)
        };
        let seen = || all().filter(|p| p.0.is_finite() && p.1.is_finite());
        let x = self.x.fix(seen().map(|p| p.0), 0.05);
        let y = self.y.fix(seen().map(|p| p.1), 0.06);
        let dots = seen().count();
        let (radius, opacity) = match dots {
            n if n > 2000 => (4, 0.35),
            n if n > 200 => (5, 0.55),
            _ => (8, 0.75),
        };
        let svg = canvas::draw(x, y, |c| {
            for ValueGroup { ink, values, .. } in &self.groups {
                c.dots(values, *ink, radius, opacity);
            }
            for ValueGroup { ink, values, .. } in &self.lines {
                c.line(values, *ink, 4, 1.0);
            }
        });
        let mut legend = LegendEntry::of_groups(&self.groups, Look::Dot);
        legend.extend(LegendEntry::of_groups(&self.lines, Look::Line));
        legend.retain(|k| !k.name.is_empty());
        Figure {
            svg,
            legend,
            title: self.title,
            note: self.note,
        }
    }
}
