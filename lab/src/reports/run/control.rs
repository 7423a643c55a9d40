//! The closed loop: what was asked for, what came of it, and what happened on the way.

use crate::reports::page::Section;
use crate::reports::plot::Figure;
use crate::reports::plot::axis::Axis;
use crate::reports::plot::line::Line;
use crate::reports::plot::theme::Ink;
use crate::reports::run::recorded::{DEGREES, Recorded};
use crate::reports::table::{Cell, Table};
use monorig_sim::error::Error;

/// Wheel slip below is not worth a plot, m/s.
const MIN_SLIP_MPS: f64 = 0.05;

/// Plots of the control, and events.
pub(crate) fn section(run: &Recorded) -> Result<Section, Error> {
    let at = |name: &str, factor: f64| run.over_time(name, factor);
    let mut section = Section::new("Control and events")
        .figure(chart(
            run,
            "Speed",
            "speed, m/s",
            vec![
                Line::new(
                    "reference",
                    Ink::Series(1),
                    at("control/reference_speed", 1.0)?,
                ),
                Line::new("true", Ink::Text, at("truth/speed", 1.0)?),
            ],
        ))
        .figure(chart(
            run,
            "Speed minus reference",
            "speed error, m/s",
            vec![speed_error(run)?],
        ))
        .figure(chart(
            run,
            "Motor torque",
            "torque at a motor shaft, N·m",
            vec![
                Line::new("acting, mean of the motors", Ink::Text, torque(run)?),
                Line::new("command", Ink::Series(0), at("control/motor_torque", 1.0)?),
            ],
        ));
    let swing = ["truth/sway_longitudinal", "truth/sway_lateral"];
    let [forward, left] = swing;
    if run.exceeds(forward, 0.0)? || run.exceeds(left, 0.0)? {
        let lines = vec![
            Line::new("forward", Ink::Series(0), at(forward, DEGREES)?),
            Line::new("left", Ink::Series(1), at(left, DEGREES)?),
        ];
        section = section.figure(chart(run, "Swing of the load", "angle, °", lines));
    }
    if run.find("truth/road/offset").is_some() {
        let offset = at("truth/road/offset", 1.0)?;
        let steering = at("truth/road/steering_angle", DEGREES)?;
        let steering = vec![Line::new("", Ink::Series(2), steering)];
        let offset = vec![Line::new("", Ink::Series(2), offset)];
        section = section
            .figure(chart(
                run,
                "Steering",
                "angle of the front wheels, °",
                steering,
            ))
            .figure(chart(
                run,
                "Beside the lane's middle",
                "offset, + left, m",
                offset,
            ));
    }
    if run.exceeds("control/brake", 0.0)? {
        let brake = vec![Line::new(
            "command",
            Ink::Series(1),
            at("control/brake", 100.0)?,
        )];
        let axis = Axis::linear("share of the brake force, %").between(-2.0, 105.0);
        let mut chart = run.chart("Brake", axis);
        chart.lines = brake;
        section = section.figure(chart.figure());
    }
    if run.exceeds("truth/largest_slip", MIN_SLIP_MPS)? {
        let slip = vec![Line::new(
            "",
            Ink::Series(1),
            at("truth/largest_slip", 1.0)?,
        )];
        section = section.figure(chart(
            run,
            "Slip of the wheel that slips most",
            "slip, m/s",
            slip,
        ));
    }
    let clearance = at("truth/clearance", 1.0)?;
    if clearance.iter().any(|c| c.1.is_finite()) {
        let line = vec![Line::new("", Ink::Series(2), clearance)];
        section = section.figure(chart(
            run,
            "Clearance",
            "least distance to obstacles, m",
            line,
        ));
    }
    Ok(match run.events.as_slice() {
        [] => section.text("No events."),
        all => section.table(events(all)),
    })
}

fn chart(run: &Recorded, title: &str, y: &str, lines: Vec<Line>) -> Figure {
    let mut chart = run.chart(title, Axis::linear(y));
    chart.lines = lines;
    chart.figure()
}

fn speed_error(run: &Recorded) -> Result<Line, Error> {
    let reference = run.column("control/reference_speed")?;
    let speed = run.over_time("truth/speed", 1.0)?;
    let error = speed.iter().zip(reference).map(|((t, v), r)| (*t, v - r));
    Ok(Line::new("", Ink::Series(0), error.collect()))
}

/// Mean torque of all motors.
fn torque(run: &Recorded) -> Result<Vec<(f64, f64)>, Error> {
    let drives: Vec<&[f64]> = (1..)
        .map_while(|i| run.find(&format!("truth/drive_{i}/motor_torque")))
        .collect();
    let mean = |row: usize| drives.iter().map(|d| d[row]).sum::<f64>() / drives.len() as f64;
    let times = run.times()?.iter().enumerate();
    Ok(times.map(|(row, t)| (*t, mean(row))).collect())
}

fn events(all: &[(f64, String)]) -> Table {
    let mut table = Table::new(&[], &["time, s"]);
    table.columns.push(("event".into(), false));
    for (t, text) in all {
        table.row([Cell::from(format!("{t:.2}")), text.clone().into()]);
    }
    table
}
