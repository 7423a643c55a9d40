//! The canvas of all plots: two axes with a grid, and shapes on them. Coordinates are those of the data.

use crate::reports::plot::axis::FixedAxis;
use crate::reports::plot::theme::{Ink, themed};
use crate::reports::plot::thin;
use plotters::chart::ChartContext;
use plotters::coord::Shift;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint};
use plotters::element::{CoordMapper, Drawable, PointCollection};
use plotters::prelude::*;

/// Size of a drawing in its own units; two of them are a pixel where two figures stand side by side.
const SIZE: (u32, u32) = (1160, 640);
/// Room for the labels of the axes, of the largest text the style sheet uses.
const LEFT: u32 = 165;
const BOTTOM: u32 = 98;
const TOP: u32 = 22;
const RIGHT: u32 = 34;
/// Number of columns to which long lines are thinned.
const COLUMNS: usize = 480;
/// Distance between the marks of a line beyond an edge, as a share of the width.
const MARKS: f64 = 40.0;
/// Text size for the layout by plotters; the style sheet sets the visible size.
const TEXT: f64 = 25.0 * 1.24;

type Coord = Cartesian2d<AxisSpan, AxisSpan>;
type Failure = DrawingAreaErrorKind<std::io::Error>;

/// An axis for plotters: linear, with our ticks.
#[derive(Clone)]
struct AxisSpan {
    low: f64,
    high: f64,
    ticks: Vec<f64>,
}

impl Ranged for AxisSpan {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, x: &f64, pixels: (i32, i32)) -> i32 {
        let share = ((x - self.low) / (self.high - self.low)).clamp(0.0, 1.0);
        (f64::from(pixels.0) + share * f64::from(pixels.1 - pixels.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.clone()
    }

    fn range(&self) -> std::ops::Range<f64> {
        self.low..self.high
    }
}

impl From<AxisSpan> for std::ops::Range<f64> {
    fn from(span: AxisSpan) -> Self {
        span.range()
    }
}

impl From<&FixedAxis> for AxisSpan {
    fn from(axis: &FixedAxis) -> Self {
        Self {
            low: axis.low,
            high: axis.high,
            ticks: axis.ticks.clone(),
        }
    }
}

/// Ends of a line across the drawing.
pub(super) fn across() -> (f64, f64) {
    (f64::NEG_INFINITY, f64::INFINITY)
}

/// Axes to draw on.
pub(super) struct Canvas<'a> {
    area: DrawingArea<SVGBackend<'a>, Coord>,
    x: FixedAxis,
    y: FixedAxis,
    failed: bool,
}

/// Draws on axes; `None` for an axis without data.
pub(super) fn draw(
    x: Option<FixedAxis>,
    y: Option<FixedAxis>,
    paint: impl FnOnce(&mut Canvas<'_>),
) -> Option<String> {
    let (x, y) = (x?, y?);
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        let area = axes(&root, &x, &y).ok()?;
        let mut canvas = Canvas {
            area,
            x,
            y,
            failed: false,
        };
        paint(&mut canvas);
        if canvas.failed {
            return None;
        }
        root.present().ok()?;
    }
    Some(themed(&svg))
}

fn axes<'a>(
    root: &DrawingArea<SVGBackend<'a>, Shift>,
    x: &FixedAxis,
    y: &FixedAxis,
) -> Result<DrawingArea<SVGBackend<'a>, Coord>, Failure> {
    let mut chart: ChartContext<'_, _, Coord> = ChartBuilder::on(root)
        .margin_top(TOP)
        .margin_right(RIGHT)
        .x_label_area_size(BOTTOM)
        .y_label_area_size(LEFT)
        .build_cartesian_2d(AxisSpan::from(x), AxisSpan::from(y))?;
    let text = ("sans-serif", TEXT).into_font();
    chart
        .configure_mesh()
        .bold_line_style(Ink::Grid.rgb())
        .light_line_style(TRANSPARENT)
        .axis_style(Ink::Muted.rgb())
        .label_style(text.color(&Ink::Text.rgb()))
        .axis_desc_style(("sans-serif", TEXT).into_font().color(&Ink::Text.rgb()))
        .x_labels(x.ticks.len().max(1))
        .y_labels(y.ticks.len().max(1))
        .x_label_formatter(&|v| x.label(*v))
        .y_label_formatter(&|v| y.label(*v))
        .x_desc(x.title.as_str())
        .y_desc(y.title.as_str())
        .draw()?;
    Ok(chart.plotting_area().clone())
}

impl<'a> Canvas<'a> {
    fn draw<'e, E, B: CoordMapper>(&mut self, element: &'e E)
    where
        &'e E: PointCollection<'e, (f64, f64), B>,
        E: Drawable<SVGBackend<'a>, B>,
    {
        self.failed |= self.area.draw(element).is_err();
    }

    fn is_inside(&self, (x, y): (f64, f64)) -> bool {
        let [x_low, x_high, low, high] = self.bounds();
        (x_low..=x_high).contains(&x) && (low..=high).contains(&y)
    }

    /// Ranges of both axes, on their scales.
    pub(crate) fn bounds(&self) -> [f64; 4] {
        [self.x.low, self.x.high, self.y.low, self.y.high]
    }

    fn scaled(&self, (x, y): (f64, f64)) -> (f64, f64) {
        (self.x.at(x), self.y.at(y))
    }

    /// A line through any number of points, cut at the axes, with gaps at points that are not finite.
    pub(crate) fn line(&mut self, points: &[(f64, f64)], ink: Ink, width: u32, opacity: f64) {
        let points: Vec<_> = points.iter().map(|p| self.scaled(*p)).collect();
        let [x_low, x_high, low, high] = self.bounds();
        let short = thin::line(&points, (x_low, x_high), COLUMNS);
        let style = ink.rgb().mix(opacity).stroke_width(width);
        for piece in thin::inside(&short, low, high) {
            match piece.as_slice() {
                // a lone sample between gaps is a dot, not nothing
                [one] => self.draw(&Circle::new(*one, width, style.filled())),
                _ => self.draw(&PathElement::new(piece, style)),
            }
        }
        self.leavers(&short, ink);
    }

    /// A triangle at the edge for points above or below the axis.
    pub(crate) fn beyond(&mut self, points: &[(f64, f64)], ink: Ink) {
        let points: Vec<_> = points.iter().map(|p| self.scaled(*p)).collect();
        self.leavers(&points, ink);
    }

    /// A triangle at the edge for each stretch in which a line is above or below the axis.
    fn leavers(&mut self, points: &[(f64, f64)], ink: Ink) {
        let [x_low, x_high, low, high] = self.bounds();
        let apart = (x_high - x_low) / MARKS;
        for (edge, tip) in [(high, -1), (low, 1)] {
            let is_out = |y: f64| if tip < 0 { y > edge } else { y < edge };
            let mut last = f64::NEG_INFINITY;
            for (x, _) in points.iter().filter(|p| is_out(p.1)) {
                if (x_low..=x_high).contains(x) && (x - last).abs() > apart {
                    let corners = vec![(-9, -16 * tip), (9, -16 * tip), (0, 0)];
                    let style = ink.rgb().filled();
                    self.draw(&(EmptyElement::at((*x, edge)) + Polygon::new(corners, style)));
                    last = *x;
                }
            }
        }
    }

    /// The area between two lines: rows of x, low, high.
    pub(crate) fn band(&mut self, rows: &[(f64, f64, f64)], ink: Ink, opacity: f64) {
        let [x_low, x_high, low, high] = self.bounds();
        let y = |y: f64| match y.is_finite() {
            true => self.y.at(y).clamp(low, high),
            false => y,
        };
        let rows = rows.iter().map(|r| (self.x.at(r.0), y(r.1), y(r.2)));
        for part in thin::band(&rows.collect::<Vec<_>>(), (x_low, x_high), COLUMNS) {
            self.polygon(outline(&part).collect(), ink, opacity);
        }
    }

    fn polygon(&mut self, outline: Vec<(f64, f64)>, ink: Ink, opacity: f64) {
        let style = ink.rgb().mix(opacity).filled();
        self.draw(&Polygon::new(outline, style));
    }

    /// Dots; dots outside the axes are left out.
    pub(crate) fn dots(&mut self, points: &[(f64, f64)], ink: Ink, radius: u32, opacity: f64) {
        let style = ink.rgb().mix(opacity).filled();
        for p in points {
            let at = self.scaled(*p);
            if self.is_inside(at) {
                self.draw(&Circle::new(at, radius, style));
            }
        }
    }

    /// A filled rectangle, cut at the axes.
    pub(crate) fn rectangle(&mut self, a: (f64, f64), b: (f64, f64), ink: Ink, opacity: f64) {
        let [x_low, x_high, low, high] = self.bounds();
        let cut = |(x, y): (f64, f64)| (x.clamp(x_low, x_high), y.clamp(low, high));
        let corners = [cut(self.scaled(a)), cut(self.scaled(b))];
        if corners.iter().all(|(x, y)| x.is_finite() && y.is_finite()) {
            self.filled(corners, ink, opacity);
        }
    }

    /// A rectangle over the whole height.
    pub(crate) fn upright(&mut self, from: f64, to: f64, ink: Ink, opacity: f64) {
        let [x_low, x_high, low, high] = self.bounds();
        let (from, to) = (self.x.at(from).max(x_low), self.x.at(to).min(x_high));
        if from < to {
            self.filled([(from, low), (to, high)], ink, opacity);
        }
    }

    fn filled(&mut self, corners: [(f64, f64); 2], ink: Ink, opacity: f64) {
        let style = ink.rgb().mix(opacity).filled();
        self.draw(&Rectangle::new(corners, style));
    }

    /// A line over the whole height at `x`.
    pub(crate) fn vertical(&mut self, x: f64, ink: Ink, width: u32) {
        let [x_low, x_high, low, high] = self.bounds();
        let x = self.x.at(x);
        if (x_low..=x_high).contains(&x) {
            self.straight([(x, low), (x, high)], ink, width);
        }
    }

    /// A line at `y`, from one value of x to another, cut at the axes.
    pub(crate) fn level(&mut self, y: f64, (from, to): (f64, f64), ink: Ink, width: u32) {
        let [x_low, x_high, low, high] = self.bounds();
        let y = self.y.at(y);
        let (from, to) = (self.x.at(from).max(x_low), self.x.at(to).min(x_high));
        if (low..=high).contains(&y) && from < to {
            self.straight([(from, y), (to, y)], ink, width);
        }
    }

    fn straight(&mut self, ends: [(f64, f64); 2], ink: Ink, width: u32) {
        let style = ink.rgb().stroke_width(width);
        self.draw(&PathElement::new(ends, style));
    }

    pub(crate) fn cross(&mut self, at: (f64, f64), ink: Ink) {
        let at = self.scaled(at);
        if self.is_inside(at) {
            self.draw(&Cross::new(at, 13, ink.rgb().stroke_width(5)));
        }
    }
}

/// The outline of the area between two lines: rows of x, low, high.
fn outline(rows: &[(f64, f64, f64)]) -> impl Iterator<Item = (f64, f64)> {
    let above = rows.iter().map(|r| (r.0, r.2));
    above.chain(rows.iter().rev().map(|r| (r.0, r.1)))
}
