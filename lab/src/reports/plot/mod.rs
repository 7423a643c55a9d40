//! Plots, one file per kind. All draw on the same canvas and end as a [`Figure`].

pub mod axis;
pub mod bars;
pub mod boxes;
pub mod canvas;
pub mod cdf;
pub mod consistency;
pub mod grouped;
pub mod heat;
pub mod history;
pub mod line;
pub mod parallel;
pub mod pareto;
pub mod scatter;
pub mod sensitivity;
pub mod stanford;
pub mod theme;
pub mod thin;

use crate::reports::html::escape;
use crate::text::number;
use theme::Ink;

/// A finished plot: drawing, title and legend.
#[derive(Clone, Debug, Default)]
pub struct Figure {
    /// Title.
    pub title: String,
    /// A sentence on how to read it; may be empty.
    pub note: String,
    /// What the colours mean. It stands above the drawing, so that it never hides data.
    pub legend: Vec<LegendEntry>,
    /// The drawing; none if there was nothing to draw.
    pub svg: Option<String>,
}

/// An entry of a legend.
#[derive(Clone, Debug)]
pub struct LegendEntry {
    /// Name.
    pub name: String,
    /// How it is drawn.
    pub look: Look,
}

/// Values of one kind, such as those of one estimator.
#[derive(Clone, Debug)]
pub struct ValueGroup<T> {
    /// Name; without one it is not in the legend.
    pub name: String,
    /// Colour.
    pub ink: Ink,
    /// Values.
    pub values: Vec<T>,
}

impl<T> ValueGroup<T> {
    /// A group.
    pub fn new(name: impl Into<String>, ink: Ink, values: Vec<T>) -> Self {
        Self {
            name: name.into(),
            ink,
            values,
        }
    }
}

/// How something is drawn.
#[derive(Clone, Copy, Debug)]
pub enum Look {
    /// A line.
    Line(Ink),
    /// An area.
    Area(Ink),
    /// A dot.
    Dot(Ink),
    /// A cross.
    Cross(Ink),
    /// The colour scale from one value to another.
    Scale(f64, f64),
}

impl LegendEntry {
    /// An entry.
    pub fn new(name: impl Into<String>, look: Look) -> Self {
        Self {
            name: name.into(),
            look,
        }
    }

    fn to_html(&self) -> String {
        let name = escape(&self.name);
        let mark = match self.look {
            Look::Line(ink) => format!(
                "<svg viewBox=\"0 0 26 12\"><line x1=\"0\" y1=\"6\" x2=\"26\" y2=\"6\" stroke-width=\"3\" {}/></svg>",
                ink.stroke()
            ),
            Look::Area(ink) => format!(
                "<svg viewBox=\"0 0 26 12\"><rect width=\"26\" height=\"12\" opacity=\"0.35\" fill=\"{}\"/></svg>",
                ink.css()
            ),
            Look::Dot(ink) => format!(
                "<svg viewBox=\"0 0 26 12\"><circle cx=\"13\" cy=\"6\" r=\"5\" fill=\"{}\"/></svg>",
                ink.css()
            ),
            Look::Cross(ink) => format!(
                "<svg viewBox=\"0 0 26 12\"><path d=\"M8 1L18 11M18 1L8 11\" stroke-width=\"2.5\" {}/></svg>",
                ink.stroke()
            ),
            Look::Scale(from, to) => {
                return format!(
                    "<li>{name}: {}<span style=\"width:8em;height:0.8em;background:{}\"></span>{}</li>",
                    number(from),
                    theme::gradient(),
                    number(to)
                );
            }
        };
        format!("<li>{mark}<span>{name}</span></li>")
    }
}

impl Figure {
    /// As HTML.
    pub fn to_html(&self) -> String {
        let title = escape(&self.title);
        let mut out = format!("<figure><figcaption>{title}");
        if !self.note.is_empty() {
            out += &format!("<p>{}</p>", escape(&self.note));
        }
        out += "</figcaption>";
        match &self.svg {
            Some(svg) => {
                if !self.legend.is_empty() {
                    let keys: String = self.legend.iter().map(LegendEntry::to_html).collect();
                    out += &format!("<ul class=\"legend\">{keys}</ul>");
                }
                out += &svg.replacen(
                    "<svg",
                    &format!("<svg class=\"plot\" role=\"img\" aria-label=\"{title}\""),
                    1,
                );
            }
            None => out += "<div class=\"nodata\">no data</div>",
        }
        out + "</figure>\n"
    }
}
