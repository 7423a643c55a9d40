//! Errors of two runs over time, in common plots.

use super::Pair;
use crate::reports::page::Section;
use crate::reports::plot::Figure;
use crate::reports::plot::axis::Axis;
use crate::reports::plot::line::{Level, Line, LineChart};
use crate::reports::plot::theme::Ink;
use crate::reports::run::errors::{ErrorGroups, mass, slope};
use monorig_sim::error::Error;

/// Colours of A and B.
const INKS: [Ink; 2] = [Ink::Series(0), Ink::Series(1)];
const LETTERS: [&str; 2] = ["A", "B"];

/// Errors of the estimators.
pub(crate) fn section(pair: &Pair) -> Result<Section, Error> {
    let mut errors = Section::new("Errors")
        .text("Estimate minus truth of the same run, where the estimator marks its value valid.");
    let slopes = [slope(&pair.a)?, slope(&pair.b)?];
    let masses = [mass(&pair.a)?, mass(&pair.b)?];
    let mut figures = Vec::new();
    for name in pair.estimators() {
        for (axis, of) in [("slope error, °", &slopes), ("mass error, %", &masses)] {
            let lines = [0, 1].map(|i| (i, errors_of(&of[i], name)));
            if lines.iter().any(|(_, points)| !points.is_empty()) {
                figures.push((name.to_owned(), chart(name, axis, lines, true)));
            }
        }
    }
    errors = pair.a.folding(errors, "Errors", figures);
    Ok(errors)
}

/// Curves of one estimator; empty if it had no valid sample.
fn errors_of(all: &ErrorGroups, name: &str) -> Vec<(f64, f64)> {
    let of = all.iter().find(|g| g.name == name);
    of.map_or(Vec::new(), |g| g.values.clone())
}

/// Lines of A (0) and B (1) over time.
pub(super) fn chart(
    title: &str,
    axis: &str,
    lines: impl IntoIterator<Item = (usize, Vec<(f64, f64)>)>,
    zero: bool,
) -> Figure {
    let mut chart = LineChart::new(title, Axis::linear("time, s"), Axis::linear(axis));
    let drawn = lines.into_iter().filter(|(_, points)| !points.is_empty());
    chart.lines = drawn
        .map(|(i, points)| Line::new(LETTERS[i], INKS[i], points))
        .collect();
    if zero {
        chart.levels.push(Level::across("", 0.0));
    }
    chart.figure()
}
