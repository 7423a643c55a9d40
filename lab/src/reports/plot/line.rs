//! Lines over a common axis, with bands of uncertainty and shaded stretches: estimates, errors, sensors, control.

use crate::reports::plot::axis::{Axis, without_outliers};
use crate::reports::plot::canvas;
use crate::reports::plot::theme::{Ink, SERIES};
use crate::reports::plot::{Figure, LegendEntry, Look};

/// A line chart.
#[derive(Clone, Debug)]
pub struct LineChart {
    pub(crate) title: String,
    /// Note for the reader.
    pub note: String,
    /// Horizontal axis.
    pub(crate) x: Axis,
    /// Vertical axis. Its range, unless set, follows the lines; bands and outliers may leave it.
    pub(crate) y: Axis,
    /// Areas, drawn first.
    pub bands: Vec<Band>,
    /// Shaded stretches of x, and their meaning.
    pub shades: Option<(String, Vec<(f64, f64)>)>,
    /// Lines.
    pub lines: Vec<Line>,
    /// Straight lines at a value of y.
    pub(crate) levels: Vec<Level>,
    /// Faults and events on the way: bands from bottom to top, and lines for what took no time.
    pub(crate) happenings: Vec<Happening>,
    /// Straight lines from bottom to top at a value of x: name, value, colour.
    pub(crate) marks: Vec<(String, f64, Ink)>,
}

/// A straight line at a value of y, from one value of x to another.
#[derive(Clone, Debug)]
pub(crate) struct Level {
    /// Name; without one it is not in the legend.
    pub(crate) name: String,
    /// Value of y.
    pub(crate) value: f64,
    /// Its ends, infinite for a line across the drawing.
    pub(crate) from_to: (f64, f64),
}

impl Level {
    /// Across the drawing.
    pub(crate) fn across(name: impl Into<String>, value: f64) -> Self {
        let from_to = canvas::across();
        Self {
            name: name.into(),
            value,
            from_to,
        }
    }
}

/// An event, such as a fault: from one value of x to another, which may be the same.
#[derive(Clone, Debug, PartialEq)]
pub struct Happening {
    /// Its name.
    pub(crate) name: String,
    /// Its beginning.
    pub(crate) from: f64,
    /// Its end.
    pub(crate) to: f64,
}

/// Colour of an event.
const HAPPENING: Ink = Ink::Series(3);
/// Largest number of names in the legend; further names are counted.
const NAMED: usize = 3;

/// A line.
#[derive(Clone, Debug)]
pub struct Line {
    /// Name; without one it is not in the legend.
    pub(crate) name: String,
    /// Colour.
    pub(crate) ink: Ink,
    /// Points; a point that is not finite is a gap.
    pub(crate) points: Vec<(f64, f64)>,
    /// Drawn as dots instead.
    pub(crate) dots: bool,
    /// Drawn faintly.
    pub(crate) faint: bool,
}

/// An area between two lines.
#[derive(Clone, Debug)]
pub struct Band {
    /// Name.
    pub name: String,
    /// Colour.
    pub ink: Ink,
    /// x, low, high.
    pub rows: Vec<(f64, f64, f64)>,
}

impl Line {
    /// A line.
    pub fn new(name: impl Into<String>, ink: Ink, points: Vec<(f64, f64)>) -> Self {
        Self {
            name: name.into(),
            ink,
            points,
            dots: false,
            faint: false,
        }
    }

    /// Draws the line as dots.
    pub(crate) fn dotted(self) -> Self {
        Self { dots: true, ..self }
    }

    /// Draws the line faintly.
    pub(crate) fn faintly(self) -> Self {
        Self {
            faint: true,
            ..self
        }
    }
}

/// One value in this number may lie outside the vertical axis at each end.
const OUTLIERS: f64 = 0.005;

/// Notes on values beyond the vertical axis.
const BAND_BEYOND: &str = "A band continues beyond the axis.";
const BEYOND: &str = "▲▼ at the edge: the line continues beyond the axis.";

impl LineChart {
    /// An empty chart.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Self {
        Self {
            title: title.into(),
            note: String::new(),
            x,
            y,
            bands: Vec::new(),
            shades: None,
            lines: Vec::new(),
            levels: Vec::new(),
            happenings: Vec::new(),
            marks: Vec::new(),
        }
    }

    /// Adds a line.
    pub fn add(&mut self, line: Line) {
        self.lines.push(line);
    }

    /// Adds a level; the first name of a level is grey, further names are dashed in their own colours.
    fn level_ink(&self, name: &str) -> Ink {
        let mut names: Vec<&str> = Vec::new();
        for level in self.levels.iter().filter(|l| !l.name.is_empty()) {
            if !names.contains(&level.name.as_str()) {
                names.push(&level.name);
            }
        }
        match names.iter().position(|n| *n == name) {
            Some(place) if place > 0 => Ink::Series(SERIES + (place - 1) as u8 % SERIES),
            _ => Ink::Muted,
        }
    }

    /// Draw it.
    pub fn figure(self) -> Figure {
        let points = || self.lines.iter().flat_map(|l| &l.points);
        let seen = || points().filter(|p| p.0.is_finite() && p.1.is_finite());
        let x = self.x.fix(seen().map(|p| p.0), 0.0);
        let mut y = self.y.clone();
        if y.range.is_none() && self.lines.iter().all(|l| l.points.len() > 50) {
            // each line by itself: a short one must not count as an outlier of a long one
            let ranges = self
                .lines
                .iter()
                .filter_map(|l| without_outliers(l.points.iter().map(|p| p.1), OUTLIERS, 0.25));
            y.range = ranges.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        }
        let levels = self.levels.iter().map(|l| l.value);
        let y = y.fix(seen().map(|p| p.1).chain(levels), 0.06);
        let leaves = |mut values: Box<dyn Iterator<Item = f64> + '_>| {
            let y = y.as_ref();
            y.is_some_and(|y| values.any(|x| y.at(x) < y.low || y.at(x) > y.high))
        };
        let rows = self.bands.iter().flat_map(|band| &band.rows);
        let notes = [
            (leaves(Box::new(seen().map(|p| p.1))), BEYOND),
            (leaves(Box::new(rows.flat_map(|r| [r.1, r.2]))), BAND_BEYOND),
        ];
        let svg = canvas::draw(x, y, |c| {
            for (from, to) in self.shades.iter().flat_map(|s| &s.1) {
                c.upright(*from, *to, Ink::Muted, 0.14);
            }
            for band in &self.bands {
                c.band(&band.rows, band.ink, 0.25);
            }
            for h in &self.happenings {
                c.upright(h.from, h.to, HAPPENING, 0.13);
                c.vertical(h.from, HAPPENING, 1);
                c.vertical(h.to, HAPPENING, 1);
            }
            for level in &self.levels {
                c.level(level.value, level.from_to, self.level_ink(&level.name), 3);
            }
            for (_, at, ink) in &self.marks {
                c.vertical(*at, *ink, 3);
            }
            for line in &self.lines {
                let opacity = match (line.faint, self.lines.len()) {
                    (true, _) => 0.4,
                    // where many lines lie over each other, all of them are seen
                    (false, n) if n > 3 && line.ink != Ink::Text => 0.8,
                    _ => 1.0,
                };
                if line.dots {
                    let radius = if line.points.len() > 100 { 4 } else { 7 };
                    c.dots(&line.points, line.ink, radius, 0.6 * opacity);
                } else {
                    c.line(&line.points, line.ink, 3, opacity);
                }
            }
        });
        let keys = self.legend();
        let notes = notes.iter().filter(|(is, _)| *is).map(|(_, note)| *note);
        let note: Vec<&str> = std::iter::once(self.note.as_str()).chain(notes).collect();
        Figure::new(self.title, note.join(" ").trim(), svg, keys)
    }

    /// Names of the faults and events.
    fn happened(&self) -> Option<String> {
        let mut names: Vec<&str> = Vec::new();
        for h in &self.happenings {
            if !names.contains(&h.name.as_str()) {
                names.push(&h.name);
            }
        }
        let more = names.len().saturating_sub(NAMED);
        names.truncate(NAMED);
        match (names.is_empty(), more) {
            (true, _) => None,
            (_, 0) => Some(names.join("; ")),
            (_, more) => Some(format!("{}; {more} more", names.join("; "))),
        }
    }

    fn legend(&self) -> Vec<LegendEntry> {
        let lines = self.lines.iter().map(|l| {
            let look = if l.dots { Look::Dot } else { Look::Line };
            LegendEntry::new(&l.name, look(l.ink))
        });
        let key = |name: &str, look: Look| LegendEntry::new(name, look);
        let bands = self.bands.iter();
        let bands = bands.map(|b| key(&b.name, Look::Area(b.ink)));
        let levels = self.levels.iter();
        let levels = levels.map(|l| key(&l.name, Look::Line(self.level_ink(&l.name))));
        let marks = self.marks.iter().map(|m| key(&m.0, Look::Line(m.2)));
        let shades = self.shades.iter().filter(|s| !s.1.is_empty());
        let shades = shades.map(|s| key(&s.0, Look::Area(Ink::Muted)));
        let happened = self.happened();
        let happened = happened.map(|name| key(&name, Look::Area(HAPPENING)));
        let mut keys: Vec<LegendEntry> = Vec::new();
        let all = lines.chain(bands).chain(levels).chain(marks).chain(shades);
        for key in all.chain(happened) {
            if !key.name.is_empty() && keys.iter().all(|k| k.name != key.name) {
                keys.push(key);
            }
        }
        keys
    }
}

/// Time intervals in which `is` is false, from rows in order of time.
pub(crate) fn stretches_without(rows: impl Iterator<Item = (f64, bool)>) -> Vec<(f64, f64)> {
    let mut out: Vec<(f64, f64)> = Vec::new();
    let mut open: Option<f64> = None;
    let mut last = f64::NAN;
    for (t, is) in rows {
        match (is, open) {
            (false, None) => open = Some(t),
            (true, Some(from)) => {
                out.push((from, t));
                open = None;
            }
            _ => {}
        }
        last = t;
    }
    if let Some(from) = open {
        out.push((from, last));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches() {
        let rows = [true, false, false, true, false].iter().enumerate();
        let rows = rows.map(|(i, &is)| (i as f64, is));
        assert_eq!(stretches_without(rows), [(1.0, 3.0), (4.0, 4.0)]);
    }

    #[test]
    fn no_numbers_no_drawing() {
        let mut chart = LineChart::new("t", Axis::linear("x"), Axis::linear("y"));
        assert!(chart.clone().figure().svg.is_none());
        chart.add(Line::new("a", Ink::Text, vec![(0.0, f64::NAN)]));
        let html = chart.clone().figure().markup().into_string();
        assert!(html.contains("no data") && !html.contains("<svg"), "{html}");
        chart.add(Line::new("b", Ink::Text, vec![(0.0, 1.0), (1.0, 2.0)]));
        assert!(chart.figure().svg.unwrap().contains("polyline"));
    }

    #[test]
    fn a_long_noisy_line_stays_small() {
        let noise = |i: u64| (i.wrapping_mul(2654435761) % 1000) as f64;
        let points = (0..300_000).map(|i| (i as f64, noise(i))).collect();
        let mut chart = LineChart::new("t", Axis::linear("x"), Axis::linear("y"));
        chart.add(Line::new("a", Ink::Text, points));
        let size = chart.figure().svg.unwrap().len();
        assert!(size < 40_000, "{size} bytes");
    }
}
