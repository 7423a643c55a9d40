//! Checks of a scenario beyond the type of each value.

use super::check_expect::{self, one_of_them};
use super::lengths;
use super::names::{near_name, valid_name};
use super::wrong::{Wrong, wrong};
use super::{DriveCycle, Event, FeedForward, PlantKind, ScenarioFile, SpeedPoint};
use crate::config::checked::NonNegative;

/// Largest number of physics steps; a longer run counts as a typing error (46 days at 4 ms).
const MAX_STEPS: f64 = 1e9;

/// Check a scenario file by itself.
pub(super) fn check(file: &ScenarioFile) -> Result<(), Wrong> {
    if file.why.trim().is_empty() {
        return wrong(
            "why",
            "a scenario needs a purpose",
            "write a sentence: what the scenario shows, and the source of the experiment",
        );
    }
    lengths::check(file)?;
    vehicle(file)?;
    stop(file)?;
    rates(file)?;
    speed(&file.drive.speed)?;
    again(&file.drive)?;
    names(file)?;
    in_loop(file)?;
    for (i, event) in file.events.iter().enumerate() {
        happens(event, file).map_err(|mut w| {
            w.key = format!("events[{i}].{}", w.key);
            w
        })?;
    }
    check_expect::check(file)
}

/// Checks the scenario of a recorded drive.
pub(super) fn check_log(file: &ScenarioFile) -> Result<(), Wrong> {
    lengths::check(file)?;
    names(file)?;
    check_expect::check(file)
}

/// Checks that the scenario has a train or a car, and that a car has no keys of a train.
fn vehicle(file: &ScenarioFile) -> Result<(), Wrong> {
    let car = match (&file.train, &file.car) {
        (Some(_), Some(_)) => {
            return wrong(
                "car",
                "this scenario has a train and a car",
                "keep one of them",
            );
        }
        (None, None) => {
            return wrong(
                "train",
                "this scenario has no vehicle",
                "`train: ../assets/trains/….yaml`, or `car: ../assets/road/….yaml` on a road",
            );
        }
        (_, car) => car.is_some(),
    };
    match (car, file.plant()) {
        (true, PlantKind::Road) | (_, PlantKind::Own(_)) => {}
        (false, PlantKind::Road) => {
            return wrong(
                "physics.plant",
                "this plant moves cars, not trains",
                "`rapier` or `point-mass`",
            );
        }
        (true, _) => {
            return wrong(
                "physics.plant",
                "this plant moves trains, not cars",
                "leave this out: a car has its own plant",
            );
        }
        (false, _) => {}
    }
    if !car {
        return Ok(());
    }
    let told = &file.vehicle;
    for (key, given) in [
        ("imu_arm_m", told.imu_arm_m.is_some()),
        ("chain_m", told.chain_m.is_some()),
        ("layout", told.layout.is_some()),
    ] {
        if given {
            let help = "leave this out: only a train has it";
            return wrong(format!("vehicle.{key}"), "a car does not have this", help);
        }
    }
    let backwards = |v: f64| v < 0.0;
    if backwards(file.start.speed_mps.get()) {
        return wrong(
            "start.speed_mps",
            "the driver of a car does not steer backwards",
            "0 or above",
        );
    }
    if let Some(i) = file.drive.speed.iter().position(|p| backwards(p.mps.get())) {
        return wrong(
            format!("drive.speed[{i}].mps"),
            "the driver of a car does not steer backwards",
            "0 or above",
        );
    }
    for (key, given) in [
        ("load.mass_kg", file.load.mass_kg.is_some()),
        ("obstacles", !file.obstacles.is_empty()),
        ("roadway", file.roadway.is_some()),
    ] {
        if given {
            return wrong(key, "only a train has this, not a car", "leave this out");
        }
    }
    for (i, event) in file.events.iter().enumerate() {
        let key = match event {
            Event::LoadMass { .. } => "load_mass_kg",
            Event::ClampPressure { .. } => "clamp_mpa",
            _ => continue,
        };
        return wrong(
            format!("events[{i}].{key}"),
            "this event can happen only to a train, not to a car",
            "leave the event out",
        );
    }
    Ok(())
}

fn stop(file: &ScenarioFile) -> Result<(), Wrong> {
    let stop = &file.stop;
    if stop.after_s.is_none() && stop.at_m.is_none() {
        return wrong(
            "stop",
            "this run has no end",
            "write `after_s` (seconds), `at_m` (chainage of the train's front), or both",
        );
    }
    let steps = stop.time_limit_s() / (file.physics.dt_ms.get() * 1e-3);
    if steps > MAX_STEPS {
        return wrong(
            "stop.after_s",
            format!("{steps:e} physics steps are too many"),
            format!(
                "at steps of {} ms, write at most {} s",
                file.physics.dt_ms.get(),
                MAX_STEPS * file.physics.dt_ms.get() * 1e-3
            ),
        );
    }
    if let (Some(start), Some(end)) = (file.start.chainage_m, stop.at_m)
        && file.start.speed_mps.get() >= 0.0
        && file.drive.speed.iter().all(|p| p.mps.get() >= 0.0)
        && end.get() <= start.get()
    {
        return wrong(
            "stop.at_m",
            format!(
                "the train starts at {} m, already beyond this chainage",
                start.get()
            ),
            "write a chainage ahead of `start.chainage_m`",
        );
    }
    Ok(())
}

/// Lowest rate of a record, Hz: a row in 100 s.
const MIN_RATE_HZ: f64 = 0.01;

/// Checks the recording rates: at most the rate of the physics, and high enough to judge a run.
fn rates(file: &ScenarioFile) -> Result<(), Wrong> {
    let most = 1e3 / file.physics.dt_ms.get();
    for (key, rate) in [
        ("record.rate_hz", file.record.rate_hz),
        ("record.pose_rate_hz", file.record.pose_rate_hz),
    ] {
        if rate.get() < MIN_RATE_HZ {
            let message = format!("{} Hz gives less than one row in 100 s", rate.get());
            return wrong(key, message, format!("write at least {MIN_RATE_HZ}"));
        }
        if rate.get() > most * (1.0 + 1e-9) {
            return wrong(
                key,
                format!(
                    "{} Hz is more than the rate of the physics steps ({} ms)",
                    rate.get(),
                    file.physics.dt_ms.get()
                ),
                format!("write at most {most}"),
            );
        }
    }
    Ok(())
}

/// The speed reference: all points by time or all by chainage, in order.
fn speed(points: &[SpeedPoint]) -> Result<(), Wrong> {
    let Some(first) = points.first() else {
        return wrong(
            "drive.speed",
            "the speed reference has no point",
            "write for example [{at_s: 0, mps: 0}, {at_s: 4, mps: 1}]",
        );
    };
    let mut before = None;
    for (i, point) in points.iter().enumerate() {
        let key = format!("drive.speed[{i}]");
        let at = match (point.at_s, point.at_m) {
            (Some(at), None) | (None, Some(at)) => at.get(),
            (Some(_), Some(_)) => {
                return wrong(
                    key,
                    "this point has both `at_s` and `at_m`",
                    "keep one of them",
                );
            }
            (None, None) => {
                return wrong(
                    key,
                    "this point has no place",
                    "write `at_s` (time) or `at_m` (chainage of the train's front)",
                );
            }
        };
        if point.at_s.is_some() != first.at_s.is_some() {
            return wrong(
                key,
                "the points mix `at_s` and `at_m`",
                "give all points by time or all by chainage",
            );
        }
        if let Some(before) = before
            && at <= before
        {
            return wrong(
                key,
                format!("{at} comes after {before} in the list"),
                "sort the points; no two at the same place",
            );
        }
        before = Some(at);
    }
    Ok(())
}

/// Checks that a repeated cycle ends at its first speed, within its period.
fn again(drive: &DriveCycle) -> Result<(), Wrong> {
    let (Some(every_s), Some(first), Some(last)) =
        (drive.every_s, drive.speed.first(), drive.speed.last())
    else {
        return Ok(());
    };
    let Some(end_s) = last.at_s else {
        return wrong(
            "drive.every_s",
            "a speed reference by chainage cannot repeat",
            "give the points by time (`at_s`), or remove `every_s`",
        );
    };
    if end_s.get() > every_s.get() {
        return wrong(
            "drive.every_s",
            format!(
                "the last point of the speed reference is at {} s, later",
                end_s.get()
            ),
            "write a period that contains all points",
        );
    }
    if first.mps.get() != last.mps.get() {
        return wrong(
            "drive.every_s",
            format!(
                "the cycle ends at {} m/s but starts again at {} m/s",
                last.mps.get(),
                first.mps.get()
            ),
            "give the last point the speed of the first",
        );
    }
    Ok(())
}

/// Checks the names of estimators, which become part of the paths of channels.
fn names(file: &ScenarioFile) -> Result<(), Wrong> {
    match file.estimators.keys().find(|name| !valid_name(name)) {
        Some(name) => wrong(
            format!("estimators.{name}"),
            format!(
                "`{name}` cannot be the name of an estimator: it becomes part of the path of its channels"
            ),
            format!(
                "letters, digits, `_` and `-`, such as `{}`",
                near_name(name)
            ),
        ),
        None => Ok(()),
    }
}

fn in_loop(file: &ScenarioFile) -> Result<(), Wrong> {
    match &file.in_loop {
        Some(name) if !file.estimators.contains_key(name) => wrong(
            "in_loop",
            format!("`{name}` is not among this scenario's estimators"),
            match file.estimators.is_empty() {
                true => format!("add the estimator: `estimators: {{{name}: {{}}}}`"),
                false => one_of_them(file, name),
            },
        ),
        None if file.drive.controller.feedforward == FeedForward::Estimate => wrong(
            "drive.controller.feedforward",
            "no estimator in the loop can give the estimate",
            "add `in_loop:` with the name of an estimator, or write `none` or `truth`",
        ),
        _ => Ok(()),
    }
}

fn happens(event: &Event, file: &ScenarioFile) -> Result<(), Wrong> {
    let end_s = file.stop.time_limit_s();
    let step_s = file.physics.dt_ms.get() * 1e-3;
    let in_time = |key: &str, at: NonNegative| {
        if at.get() >= end_s {
            wrong(
                key,
                format!("the run ends at {end_s} s, before this event"),
                "write an earlier time, or let the run last longer",
            )
        } else {
            Ok(())
        }
    };
    let in_order = |key: &str, from: f64, to: f64| {
        if to <= from {
            wrong(
                key,
                format!("this ends at {to}, before it starts at {from}"),
                "write an end that is later than the start",
            )
        } else {
            Ok(())
        }
    };
    match event {
        Event::LoadMass { at_s, every_s, .. }
        | Event::ClampPressure { at_s, every_s, .. }
        | Event::Brake { at_s, every_s, .. }
        | Event::DraggingBrake { at_s, every_s, .. }
        | Event::IsolatedDrive { at_s, every_s, .. }
        | Event::Restart { at_s, every_s, .. } => {
            in_time("at_s", *at_s)?;
            match every_s {
                Some(every_s) if every_s.get() < step_s => wrong(
                    "every_s",
                    format!("{} s is shorter than a physics step", every_s.get()),
                    "write the time between two of these events, in seconds",
                ),
                _ => Ok(()),
            }
        }
        Event::Adhesion { from_m, to_m, .. } => in_order("to_m", from_m.get(), to_m.get()),
        Event::SensorFault { from_s, .. } => {
            in_time("from_s", *from_s)?;
            let good = event.sensor_fault().map(drop);
            good.or_else(|e| wrong(&e.key, e.message, &e.help))
        }
    }
}
