//! The measurements of a replayed log, in place of the closed loop of a simulation.

use crate::reports::page::Section;
use crate::reports::plot::axis::Axis;
use crate::reports::plot::line::Line;
use crate::reports::plot::theme::Ink;
use crate::reports::run::recorded::{DEGREES, Recorded};
use monorig_sim::error::Error;

/// Largest number of wheels or motors that are drawn.
const MAX_LINES: usize = 8;

/// Plots of speed, specific force, angular rate and traction, if the log has these signals.
pub(crate) fn section(run: &Recorded) -> Result<Section, Error> {
    let lines = |columns: Vec<(String, String)>, factor: f64| -> Result<Vec<Line>, Error> {
        let there = columns.iter().enumerate();
        let there = there.filter(|(_, (_, column))| run.find(column).is_some());
        let line = |(i, (name, column)): (usize, &(String, String))| {
            run.line((name, Ink::series(i)), column, factor)
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
    let torques = of_drives("motor_torque");
    let mut section = Section::new("Measured");
    for (title, y, columns, factor) in [
        ("Wheel speed", "speed, m/s", of_drives("wheel_speed"), 1.0),
        ("Specific force", "specific force, m/s²", force, 1.0),
        ("Angular rate", "angular rate, °/s", rate, DEGREES),
        ("Motor torque", "torque at a motor shaft, N·m", torques, 1.0),
    ] {
        let lines = lines(columns, factor)?;
        section = section.figure(run.figure(title, Axis::linear(y), lines));
    }
    Ok(section)
}
