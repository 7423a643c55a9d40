//! Errors of two runs over time, in common plots.

use super::Pair;
use crate::metrics::Quantity;
use crate::reports::page::Section;
use crate::reports::plot::Figure;
use crate::reports::plot::axis::Axis;
use crate::reports::plot::line::{Band, Level, Line, LineChart};
use crate::reports::plot::theme::Ink;
use crate::reports::run::errors::{mass, slope, told};
use monorig_sim::error::Error;

/// Colours of A and B.
const INKS: [Ink; 2] = [Ink::Series(0), Ink::Series(1)];
const LETTERS: [&str; 2] = ["A", "B"];

/// Errors of the estimators.
pub(crate) fn section(pair: &Pair) -> Result<Section, Error> {
    let mut errors = Section::new("Errors")
        .text("Estimate minus truth of the same run, where the estimator marks its value valid.");
    let runs = [&pair.a, &pair.b];
    let slopes = [slope(&pair.a)?, slope(&pair.b)?];
    let masses = [mass(&pair.a)?, mass(&pair.b)?];
    let mut figures = Vec::new();
    for name in pair.estimators() {
        for (quantity, of) in [(Quantity::Slope, &slopes), (Quantity::Mass, &masses)] {
            let (mut lines, mut bands) = (Vec::new(), Vec::new());
            for (i, groups) in of.iter().enumerate() {
                // an estimator without a valid sample has no curve
                let Some(group) = groups.iter().find(|g| g.name == name) else {
                    continue;
                };
                let name = format!("± 2 σ of {}", LETTERS[i]);
                lines.push((i, group.values.clone()));
                bands.push(Band {
                    name,
                    ink: INKS[i],
                    ..told(runs[i], quantity, group)?
                });
            }
            if !lines.is_empty() {
                let axis = format!("{} error, {}", quantity.words(), quantity.unit().0);
                figures.push((name.to_owned(), chart(name, &axis, lines, bands)));
            }
        }
    }
    errors = pair.a.folding(errors, "Errors", figures);
    Ok(errors)
}

/// Lines of A (0) and B (1) over time, with a line at zero behind them if they are errors, which have bands.
pub(super) fn chart(
    title: &str,
    axis: &str,
    lines: impl IntoIterator<Item = (usize, Vec<(f64, f64)>)>,
    bands: Vec<Band>,
) -> Figure {
    let mut chart = LineChart::new(title, Axis::linear("time, s"), Axis::linear(axis));
    let drawn = lines.into_iter().filter(|(_, points)| !points.is_empty());
    chart.lines = drawn
        .map(|(i, points)| Line::new(LETTERS[i], INKS[i], points))
        .collect();
    if !bands.is_empty() {
        chart.levels.push(Level::across("", 0.0));
    }
    chart.bands = bands;
    chart.figure()
}
