//! Stanford diagram: error against protection level, with the alert limit (Tossaint et al. 2007).

use crate::reports::plot::axis::Axis;
use crate::reports::plot::canvas;
use crate::reports::plot::theme::Ink;
use crate::reports::plot::{Figure, LegendEntry, Look};
use std::collections::BTreeSet;

/// Valid samples of one quantity of one estimator.
#[derive(Clone, Debug)]
pub(crate) struct Stanford {
    pub(crate) title: String,
    /// Note for the reader.
    pub(crate) note: String,
    /// Unit of errors, such as `°`.
    pub(crate) unit: String,
    /// Alert limit.
    pub(crate) alert: f64,
    /// Colour of the points.
    pub(crate) ink: Ink,
    /// Absolute error and protection level of every valid sample.
    pub(crate) samples: Vec<(f64, f64)>,
}

/// Least and largest range of both axes, in alert limits.
const REACH: (f64, f64) = (1.5, 20.0);

impl Stanford {
    /// Draw it.
    pub(crate) fn figure(self) -> Figure {
        let finite: Vec<(f64, f64)> = self
            .samples
            .iter()
            .copied()
            .filter(|(e, p)| e.is_finite() && p.is_finite())
            .collect();
        if finite.is_empty() {
            return Figure::empty(self.title);
        }
        let largest = finite.iter().fold(0.0, |m: f64, (e, p)| m.max(*e).max(*p));
        let end = (1.05 * largest).clamp(REACH.0 * self.alert, REACH.1 * self.alert);
        let axis = |title: String| Axis::linear(title).between(0.0, end);
        let x = axis(format!("|error|, {}", self.unit)).fix([0.0, end].into_iter(), 0.0);
        let y = axis(format!("protection level, {}", self.unit)).fix([0.0, end].into_iter(), 0.0);
        let a = self.alert;
        let cells = |beyond: bool| {
            let samples = finite.iter().filter(|(e, p)| (e.max(*p) > end) == beyond);
            one_a_cell(samples.map(|(e, p)| (e.min(end), p.min(end))), end)
        };
        let (inside, beyond) = (cells(false), cells(true));
        let radius = if inside.len() > 200 { 4 } else { 7 };
        let svg = canvas::draw(x, y, |c| {
            // below the diagonal and beyond the alert limit
            c.band(&[(a, 0.0, a), (end, 0.0, end)], Ink::Bad, 0.14);
            c.dots(&inside, self.ink, radius, 0.6);
            for at in &beyond {
                c.cross(*at, self.ink);
            }
            c.line(&[(0.0, 0.0), (end, end)], Ink::Text, 3, 0.8);
            c.line(&[(a, 0.0), (a, a)], Ink::Bad, 4, 1.0);
            c.line(&[(0.0, a), (a, a)], Ink::Muted, 3, 1.0);
            c.line(&[(a, a), (a, end)], Ink::Muted, 3, 0.4);
        });
        let mut figure = Figure {
            svg,
            legend: vec![
                LegendEntry::new("valid samples", Look::Dot(self.ink)),
                LegendEntry::new("|error| = protection level", Look::Line(Ink::Text)),
                LegendEntry::new(
                    format!("alert limit {a:.3} {}", self.unit),
                    Look::Line(Ink::Bad),
                ),
                LegendEntry::new("misleading", Look::Area(Ink::Bad)),
            ],
            title: self.title,
            note: self.note,
        };
        if !beyond.is_empty() {
            let look = Look::Cross(self.ink);
            figure.legend.push(LegendEntry::new("beyond an axis", look));
        }
        figure
    }
}

/// Number of cells along each axis; one sample of each cell is drawn: a dot is as large.
const CELLS: f64 = 200.0;

/// The first sample of every cell: many samples are close to each other.
fn one_a_cell(samples: impl Iterator<Item = (f64, f64)>, end: f64) -> Vec<(f64, f64)> {
    let mut taken = BTreeSet::new();
    let cell = |x: f64| (CELLS * x / end) as u32;
    let mut kept: Vec<(f64, f64)> = samples.collect();
    kept.retain(|(e, p)| taken.insert((cell(*e), cell(*p))));
    kept
}
