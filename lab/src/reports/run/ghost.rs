//! A log compared with its ghost: a train with the parameters of the estimators on the same drive.

use crate::reports::page::Section;
use crate::reports::plot::Figure;
use crate::reports::plot::axis::Axis;
use crate::reports::plot::line::Line;
use crate::reports::plot::theme::Ink;
use crate::reports::run::recorded::Recorded;
use monorig_sim::error::Error;

/// Measured signals and signals of the ghost; `None` for a run without a ghost.
pub(crate) fn section(run: &Recorded) -> Result<Option<Section>, Error> {
    if run.find("ghost/traction").is_none() {
        return Ok(None);
    }
    let mut section = Section::new("Log and ghost");
    for (title, axis, path) in [
        ("Traction", "force at the rims, N", "traction"),
        (
            "Motor torque, mean of the motors",
            "torque, N·m",
            "motor_torque",
        ),
        (
            "Specific force forward",
            "specific force, m/s²",
            "specific_force_x",
        ),
    ] {
        section = section.figure(chart(run, title, axis, &format!("ghost/{path}"))?);
    }
    Ok(Some(section))
}

fn chart(run: &Recorded, title: &str, axis: &str, path: &str) -> Result<Figure, Error> {
    let ghost = run.over_time(path, 1.0)?;
    let off = run.over_time(&format!("{path}_difference"), 1.0)?;
    let measured = ghost.iter().zip(&off).map(|(g, d)| (g.0, g.1 + d.1));
    let lines = vec![
        Line::new("measured, mean of a second", Ink::Text, measured.collect()),
        Line::new("ghost", Ink::Series(0), ghost),
        Line::new("measured minus ghost", Ink::Series(1), off),
    ];
    Ok(run.figure(title, Axis::linear(axis), lines))
}
