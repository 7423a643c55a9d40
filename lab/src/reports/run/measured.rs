//! The measurements of a replayed log, in place of the closed loop of a simulation.

use crate::reports::page::Section;
use crate::reports::plot::Figure;
use crate::reports::plot::axis::Axis;
use crate::reports::plot::line::Line;
use crate::reports::plot::theme::Ink;
use crate::reports::run::recorded::{DEGREES, Recorded};
use monorig_sim::error::Error;

/// Most wheels or motors that are drawn.
const MAX_LINES: usize = 8;

/// Plots of speed, specific force, angular rate and traction, as far as the log has them.
pub(crate) fn section(run: &Recorded) -> Result<Section, Error> {
    let lines = |columns: Vec<(String, String)>, factor: f64| -> Result<Vec<Line>, Error> {
        let there = columns.iter().enumerate();
        let there = there.filter(|(_, (_, column))| run.find(column).is_some());
        let line = |(i, (name, column)): (usize, &(String, String))| {
            let rows = run.over_time(column, factor)?;
            Ok(Line::new(name.as_str(), Ink::series(i), rows))
        };
        there.map(line).collect()
    };
    let imu = |what: &str, axes: &[(&str, &str)]| -> Vec<(String, String)> {
        let column = |axis: &str| format!("sensors/imu/{what}_{axis}");
        let each = axes.iter();
        each.map(|(axis, name)| ((*name).to_owned(), column(axis)))
            .collect()
    };
    let of_drives = |what: &str| -> Vec<(String, String)> {
        let column = |i: usize| format!("sensors/drive_{i}/{what}");
        (1..=MAX_LINES)
            .map(|i| (i.to_string(), column(i)))
            .collect()
    };
    let force = imu("specific_force", &[("x", "forward"), ("y", "left")]);
    let rate = imu(
        "angular_rate",
        &[
            ("x", "about forward"),
            ("y", "about left"),
            ("z", "about up"),
        ],
    );
    Ok(Section::new("Measured")
        .figure(chart(
            run,
            "Wheel speed",
            "speed, m/s",
            lines(of_drives("wheel_speed"), 1.0)?,
        ))
        .figure(chart(
            run,
            "Specific force",
            "specific force, m/s²",
            lines(force, 1.0)?,
        ))
        .figure(chart(
            run,
            "Angular rate",
            "angular rate, °/s",
            lines(rate, DEGREES)?,
        ))
        .figure(chart(
            run,
            "Motor torque",
            "torque at a motor shaft, N·m",
            lines(of_drives("motor_torque"), 1.0)?,
        )))
}

fn chart(run: &Recorded, title: &str, y: &str, lines: Vec<Line>) -> Figure {
    let mut chart = run.chart(title, Axis::linear(y));
    chart.lines = lines;
    chart.figure()
}
