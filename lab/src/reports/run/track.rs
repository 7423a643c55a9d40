//! The way of the vehicle: slope, height and curvature along the chainage.

use crate::reports::page::Section;
use crate::reports::plot::Figure;
use crate::reports::plot::axis::Axis;
use crate::reports::plot::line::{Line, LineChart};
use crate::reports::plot::theme::Ink;
use crate::reports::run::recorded::{DEGREES, Recorded};
use monorig_sim::error::Error;

/// Plots of the track that the vehicle covered.
pub(crate) fn section(run: &Recorded) -> Result<Section, Error> {
    let line = |name: &str, ink: Ink, column: &str, factor: f64| -> Result<Line, Error> {
        let rows = run
            .column("truth/chainage")?
            .iter()
            .zip(run.column(column)?);
        let rows = rows.map(|(s, x)| (*s, x * factor)).collect();
        Ok(Line::new(name, ink, rows))
    };
    let [first, second] = [Ink::Series(0), Ink::Series(1)];
    let whole = "of the whole vehicle";
    let slope = vec![
        line(whole, Ink::Muted, "truth/grade_effective", DEGREES)?,
        line("at the IMU", first, "truth/grade_at_imu", DEGREES)?,
    ];
    let [across, up] = ["truth/curvature_horizontal", "truth/curvature_vertical"];
    let curvature = vec![
        line("horizontal, + left", first, across, 1.0)?,
        line("vertical, + sag", second, up, 1.0)?,
    ];
    let height = vec![Line::new("", Ink::Series(0), heights(run)?)];
    Ok(Section::new("Track")
        .figure(chart("Slope", "slope, °", slope))
        .figure(chart("Height", "height above the start, m", height))
        .figure(chart("Curvature", "curvature, 1/m", curvature)))
}

fn chart(title: &str, y: &str, lines: Vec<Line>) -> Figure {
    let mut chart = LineChart::new(
        title,
        Axis::linear("chainage of the IMU, m"),
        Axis::linear(y),
    );
    chart.lines = lines;
    chart.figure()
}

/// Height of the IMU's place on the rail above its first one: the integral of sin θ ds (trapezoids).
fn heights(run: &Recorded) -> Result<Vec<(f64, f64)>, Error> {
    let rows = run
        .column("truth/chainage")?
        .iter()
        .zip(run.column("truth/grade_at_imu")?);
    let mut height = 0.0;
    let mut before: Option<(f64, f64)> = None;
    let heights = rows.map(|(&s, &grade)| {
        if let Some((s0, grade0)) = before {
            height += 0.5 * (grade.sin() + grade0.sin()) * (s - s0);
        }
        before = Some((s, grade));
        (s, height)
    });
    Ok(heights.collect())
}
