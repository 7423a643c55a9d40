//! Points in a plane: one quantity against another.

use crate::reports::plot::axis::{Axis, with_asides};
use crate::reports::plot::canvas;
use crate::reports::plot::{Figure, Look, ValueGroup, legend};

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
    /// Points; the vertical axis follows those that are not aside, if there are any.
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
        let all_aside = self.groups.iter().all(|g| g.aside);
        let of = |main: bool| {
            let groups = self.groups.iter();
            let groups = groups.filter(move |g| (all_aside || !g.aside) == main);
            groups.flat_map(|g| &g.values).map(|p| p.1)
        };
        let y = self
            .y
            .fix(with_asides(of(true), of(false)).into_iter(), 0.06);
        let dots = seen().count();
        let (radius, opacity) = match dots {
            n if n > 2000 => (4, 0.35),
            n if n > 200 => (5, 0.55),
            _ => (8, 0.75),
        };
        let svg = canvas::draw(x, y, |c| {
            for ValueGroup { ink, values, .. } in &self.groups {
                c.dots(values, *ink, radius, opacity);
                c.beyond(values, *ink);
            }
            for ValueGroup { ink, values, .. } in &self.lines {
                c.line(values, *ink, 4, 1.0);
            }
        });
        let keys = legend(&self.groups, Look::Dot).chain(legend(&self.lines, Look::Line));
        let keys = keys.filter(|k| !k.name.is_empty());
        Figure::new(self.title, self.note, svg, keys)
    }
}
