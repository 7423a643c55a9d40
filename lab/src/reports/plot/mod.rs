//! Plots, one file per kind. All draw on the same canvas and end as a [`Figure`].

pub mod axis;
pub mod boxes;
pub(crate) mod canvas;
pub mod cdf;
pub mod consistency;
pub mod history;
pub mod line;
pub mod pareto;
pub mod scatter;
pub(crate) mod stanford;
pub mod theme;
pub(crate) mod thin;

use crate::reports::html::escape;
use maud::{Markup, PreEscaped, html};
use theme::Ink;

/// A finished plot: drawing, title and legend.
#[derive(Clone, Debug, Default)]
pub struct Figure {
    pub(crate) title: String,
    /// A sentence on how to read it; may be empty.
    pub(crate) note: String,
    /// Legend. It stands above the drawing, so that it never hides data.
    pub(crate) legend: Vec<LegendEntry>,
    /// The drawing; `None` if there is nothing to draw.
    pub svg: Option<String>,
}

/// An entry of a legend.
#[derive(Clone, Debug)]
pub(crate) struct LegendEntry {
    pub(crate) name: String,
    /// Shape and colour.
    pub(crate) look: Look,
}

/// Values of one kind, such as values of one estimator.
#[derive(Clone, Debug)]
pub struct ValueGroup<T> {
    /// Name; without one it is not in the legend.
    pub(crate) name: String,
    /// Colour.
    pub(crate) ink: Ink,
    /// Values.
    pub values: Vec<T>,
    /// True for values that the axes need not show, such as values of an estimator that is not judged.
    pub(crate) aside: bool,
}

impl<T> ValueGroup<T> {
    /// A group.
    pub fn new(name: impl Into<String>, ink: Ink, values: Vec<T>) -> Self {
        Self {
            name: name.into(),
            ink,
            values,
            aside: false,
        }
    }

    /// The same, as values that the axes need not show.
    pub(crate) fn aside(self, aside: bool) -> Self {
        Self { aside, ..self }
    }
}

/// Shape and colour of an entry of the legend.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Look {
    /// A line.
    Line(Ink),
    /// An area.
    Area(Ink),
    /// A dot.
    Dot(Ink),
    /// A cross.
    Cross(Ink),
}

/// An entry of the legend for each group.
pub(crate) fn legend<T>(
    groups: &[ValueGroup<T>],
    look: fn(Ink) -> Look,
) -> impl Iterator<Item = LegendEntry> {
    groups
        .iter()
        .map(move |g| LegendEntry::new(&g.name, look(g.ink)))
}

impl LegendEntry {
    /// An entry.
    pub(crate) fn new(name: impl Into<String>, look: Look) -> Self {
        Self {
            name: name.into(),
            look,
        }
    }

    fn markup(&self) -> Markup {
        let key = |shape: Markup| html! { li { svg viewBox="0 0 26 12" { (shape) } span { (self.name) } } };
        match self.look {
            Look::Line(ink) => key(html! {
                line x1="0" y1="6" x2="26" y2="6" stroke-width="3" stroke=(ink.css()) stroke-dasharray=[ink.dashes()] {}
            }),
            Look::Area(ink) => {
                key(html! { rect width="26" height="12" opacity="0.35" fill=(ink.css()) {} })
            }
            Look::Dot(ink) => key(html! { circle cx="13" cy="6" r="5" fill=(ink.css()) {} }),
            Look::Cross(ink) => key(html! {
                path d="M8 1L18 11M18 1L8 11" stroke-width="2.5" stroke=(ink.css()) stroke-dasharray=[ink.dashes()] {}
            }),
        }
    }
}

impl Figure {
    /// A figure of a drawing, if there is one, and its legend.
    pub(crate) fn new(
        title: impl Into<String>,
        note: impl Into<String>,
        svg: Option<String>,
        legend: impl IntoIterator<Item = LegendEntry>,
    ) -> Self {
        Self {
            title: title.into(),
            note: note.into(),
            legend: legend.into_iter().collect(),
            svg,
        }
    }

    /// A figure without data.
    pub(crate) fn empty(title: String) -> Self {
        Self::new(title, "", None, [])
    }

    /// The figure as HTML. The legend stands above the drawing.
    pub(crate) fn markup(&self) -> Markup {
        html! {
            figure {
                figcaption {
                    (self.title)
                    @if !self.note.is_empty() { p { (self.note) } }
                }
                @if let Some(svg) = &self.svg {
                    @if !self.legend.is_empty() {
                        ul.legend { @for entry in &self.legend { (entry.markup()) } }
                    }
                    (PreEscaped(self.labelled(svg)))
                } @else {
                    div.nodata { "no data" }
                }
            }
        }
    }

    /// The drawing with the title as its label, for readers who cannot see the drawing.
    fn labelled(&self, svg: &str) -> String {
        let title = escape(&self.title);
        let label = format!("<svg class=\"plot\" role=\"img\" aria-label=\"{title}\"");
        svg.replacen("<svg", &label, 1)
    }
}
