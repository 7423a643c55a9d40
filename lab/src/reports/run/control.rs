//! The closed loop: what was asked for, what came of it, and what happened on the way.

use crate::reports::page::Section;
use crate::reports::plot::axis::Axis;
use crate::reports::plot::line::Line;
use crate::reports::plot::theme::Ink;
use crate::reports::run::recorded::{DEGREES, Recorded};
use crate::reports::table::{Cell, Table};
use monorig_sim::error::Error;

/// Least wheel slip that is plotted, m/s.
const MIN_SLIP_MPS: f64 = 0.05;

/// Plots of the control, and events.
pub(crate) fn section(run: &Recorded) -> Result<Section, Error> {
    let line = |name: &str, ink: u8, column: &str, factor: f64| {
        run.line((name, Ink::Series(ink)), column, factor)
    };
    let speeds = vec![
        line("reference", 1, "control/reference_speed", 1.0)?,
        run.line(("true", Ink::Text), "truth/speed", 1.0)?,
    ];
    let torques = vec![
        Line::new("actual, mean of the motors", Ink::Text, torque(run)?),
        line("command", 0, "control/motor_torque", 1.0)?,
    ];
    let mut figures = Vec::new();
    let mut add = |title, y, lines| figures.push(run.figure(title, y, lines));
    let y = |title: &str| Axis::linear(title);
    add("Speed", y("speed, m/s"), speeds);
    let error = vec![speed_error(run)?];
    add("Speed minus reference", y("speed error, m/s"), error);
    add("Motor torque", y("torque at a motor shaft, N·m"), torques);
    let [forward, left] = ["truth/sway_longitudinal", "truth/sway_lateral"];
    if run.exceeds(forward, 0.0)? || run.exceeds(left, 0.0)? {
        let lines = vec![
            line("forward", 0, forward, DEGREES)?,
            line("left", 1, left, DEGREES)?,
        ];
        add("Swing of the load", y("angle, °"), lines);
    }
    if run.find("truth/road/offset").is_some() {
        let offset = vec![line("", 2, "truth/road/offset", 1.0)?];
        let steering = vec![line("", 2, "truth/road/steering_angle", DEGREES)?];
        add("Steering", y("angle of the front wheels, °"), steering);
        add("Beside the lane's middle", y("offset, + left, m"), offset);
    }
    if run.exceeds("control/brake", 0.0)? {
        let brake = vec![line("command", 1, "control/brake", 100.0)?];
        let share = y("share of the brake force, %").between(-2.0, 105.0);
        add("Brake", share, brake);
    }
    if run.exceeds("truth/largest_slip", MIN_SLIP_MPS)? {
        let slip = vec![line("", 1, "truth/largest_slip", 1.0)?];
        add("Slip of the wheel that slips most", y("slip, m/s"), slip);
    }
    let clearance = line("", 2, "truth/clearance", 1.0)?;
    if clearance.points.iter().any(|c| c.1.is_finite()) {
        let least = y("least distance to obstacles, m");
        add("Clearance", least, vec![clearance]);
    }
    let section = Section::new("Control and events").figures(figures);
    Ok(match run.events.as_slice() {
        [] => section.text("No events."),
        all => section.table(events(all)),
    })
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
