//! Checks of a map file beyond the type of each value.

use super::channel_keys::{ScalarChannel, Traction, VectorChannel};
use super::channels::{Channels, MeasuredChannel, key, quantity};
use super::file::MapFile;
use super::reference_keys::{References, SlopeReference};
use crate::notation::{Quantity, TimeUnit, UnitName};
use monorig_estimators::api::signals::{MAX_DRIVES, Measurand, Shape};

pub(super) type Wrong = (String, String, String);

fn wrong<T>(
    key: impl Into<String>,
    message: impl Into<String>,
    help: impl Into<String>,
) -> Result<T, Wrong> {
    Err((key.into(), message.into(), help.into()))
}

/// Steps per second that are taken for a mistake.
const MAX_RATE_HZ: f64 = 10_000.0;

/// Files of a log, each of which a thread reads.
const MAX_FILES: usize = 200;

/// Check a map file by itself.
pub(super) fn check(file: &MapFile) -> Result<(), Wrong> {
    if let Some(name) = file
        .clocks
        .keys()
        .find(|name| !file.files.contains_key(*name))
    {
        return wrong(
            format!("clocks.{name}"),
            format!("`files` has no file `{name}`"),
            "use a name of `files`",
        );
    }
    let times = file.clocks.iter();
    let times =
        times.map(|(name, c)| (format!("clocks.{name}"), c.wraps, c.unit.or(file.time.unit)));
    for (key, wraps, unit) in times.chain([("time".into(), file.time.wraps, file.time.unit)]) {
        let counts = unit.is_some_and(|unit| unit != TimeUnit::Iso8601);
        if wraps.is_some_and(|bits| !counts || !(8..=48).contains(&bits)) {
            return wrong(
                format!("{key}.wraps"),
                "a counter that wraps needs 8 to 48 bits, and a unit",
                "`unit: us, wraps: 32` for a counter of microseconds with 32 bits",
            );
        }
    }
    if file.files.len() > MAX_FILES {
        return wrong(
            "files",
            format!("{} files are too many for a log", file.files.len()),
            format!("at most {MAX_FILES}"),
        );
    }
    if file.time.pieces.is_some() && file.files.len() > 1 {
        return wrong(
            "time.pieces",
            "runs in which time begins again cannot be separated in several files",
            "use one file, or times that grow",
        );
    }
    if file.step.rate_hz.get() > MAX_RATE_HZ || file.step.rate_hz.get() < 1.0 {
        return wrong(
            "step.rate_hz",
            "the estimators are not made for these steps",
            "use 1 to 10000 Hz; 100 or 200 are usual",
        );
    }
    if file.vehicle.is_none()
        && (file.nominal.tare_kg.is_none() || file.nominal.wheel_radius_m.is_none())
    {
        return wrong(
            "vehicle",
            "the estimators need the vehicle's data",
            "give `vehicle: FILE` with a train or a car, or `nominal:` with at least tare_kg and wheel_radius_m",
        );
    }
    if let (Some(from), Some(until)) = (file.trim.from_s, file.trim.until_s)
        && from.get() >= until.get()
    {
        return wrong(
            "trim.until_s",
            "the played part ends before its begin",
            "a time after `from_s`",
        );
    }
    channels(&file.channels)?;
    references(&file.reference)
}

fn channels(c: &Channels) -> Result<(), Wrong> {
    for (measurand, channel) in &c.measured {
        if let MeasuredChannel::Vector(channel) = channel {
            vector(&key(*measurand, 0), channel, quantity(*measurand))?;
        }
    }
    let of_use = |m: &Measurand| matches!(m.shape(), Shape::Vector | Shape::Auxiliary);
    if !c.measured.keys().any(of_use) && c.wheel_speed.is_empty() && c.traction.is_none() {
        return wrong(
            "channels",
            "the map uses no channel of the log",
            "give at least one of specific_force, angular_rate, wheel_speed, traction",
        );
    }
    let mut wheels = 0;
    for (i, w) in c.wheel_speed.iter().enumerate() {
        let key = format!("channels.wheel_speed[{i}]");
        unit(&key, &w.unit, Quantity::Speed)?;
        sign(&key, w.sign.get())?;
        wheels += w.columns.len();
        if w.columns.is_empty() || wheels > MAX_DRIVES {
            return wrong(
                format!("{key}.columns"),
                format!("the map has {} wheels", wheels),
                format!("1 to {MAX_DRIVES} wheels together"),
            );
        }
    }
    if let Some(t) = &c.traction {
        traction("channels.traction", t)?;
    }
    if let Some(command) = &c.command {
        let key = "channels.command";
        sign(key, command.sign.get())?;
        match &command.unit {
            Some(u) => unit(key, u, Quantity::Torque)?,
            None if command.torque.is_empty() => {}
            None => {
                return wrong(
                    format!("{key}.unit"),
                    "the unit of the torques is missing",
                    Quantity::Torque.names(),
                );
            }
        }
        let else_empty = command.brake.is_none() && command.clamp_pressure_mpa.is_none();
        if command.torque.is_empty() && else_empty {
            return wrong(key, "the command has no column", "`torque` or `brake`");
        }
        if command.torque.len() > MAX_DRIVES {
            return wrong(
                format!("{key}.torque"),
                format!("the map has {} motors", command.torque.len()),
                format!("1 to {MAX_DRIVES}"),
            );
        }
    }
    for (measurand, channel) in &c.measured {
        match channel {
            MeasuredChannel::Vector(_) => {}
            MeasuredChannel::Scalar(s) => scalar(*measurand, 0, s)?,
            MeasuredChannel::List(list) => {
                let most = measurand.shape().slots();
                if list.len() > most {
                    return wrong(
                        format!("channels.{}", measurand.name()),
                        format!("the map has {} of these columns", list.len()),
                        format!("at most {most}"),
                    );
                }
                for (i, s) in list.iter().enumerate() {
                    scalar(*measurand, i, s)?;
                }
            }
        }
    }
    Ok(())
}

fn scalar(measurand: Measurand, index: usize, s: &ScalarChannel) -> Result<(), Wrong> {
    let key = key(measurand, index);
    unit(&key, &s.unit, quantity(measurand))?;
    sign(&key, s.sign.get())
}

fn vector(key: &str, v: &VectorChannel, quantity: Quantity) -> Result<(), Wrong> {
    unit(key, &v.unit, quantity)?;
    let force = quantity == Quantity::Acceleration;
    if v.lean_deg_per_g.is_some() && !force {
        return wrong(
            format!("{key}.lean_deg_per_g"),
            "the lean is corrected only in the specific force",
            "use this key in `specific_force`",
        );
    }
    if let Some(c) = &v.calibrate {
        if c.slope_deg.is_some() && !force {
            return wrong(
                format!("{key}.calibrate.slope_deg"),
                "a gyro does not depend on the slope",
                "leave this out",
            );
        }
        let m = &v.mount_deg;
        if force && (m.roll.get() != 0.0 || m.pitch.get() != 0.0) {
            return wrong(
                format!("{key}.calibrate"),
                "roll and pitch of the mount are given, but must also be found",
                "keep only one of the two",
            );
        }
    }
    let Some(axes) = v.axes else { return Ok(()) };
    let number = |axis: super::Axis| {
        use super::Axis::*;
        match axis {
            Forward => (0, 1),
            Backward => (0, -1),
            Left => (1, 1),
            Right => (1, -1),
            Up => (2, 1),
            Down => (2, -1),
        }
    };
    let [a, b, c] = axes.map(number);
    if a.0 == b.0 || b.0 == c.0 || a.0 == c.0 {
        return wrong(
            format!("{key}.axes"),
            "two axes have the same direction",
            "use one of forward/backward, one of left/right, one of up/down",
        );
    }
    // a right-handed triad has determinant 1: a turned box is one, a mirrored one does not exist
    let even = (b.0 + 3 - a.0) % 3 == 1;
    if a.1 * b.1 * c.1 * if even { 1 } else { -1 } != 1 {
        return wrong(
            format!("{key}.axes"),
            "these axes are left-handed, but instruments are right-handed",
            "use axes such as [forward, left, up] or [forward, right, down]; write a column with the other sign as `= -column`",
        );
    }
    Ok(())
}

fn traction(key: &str, t: &Traction) -> Result<(), Wrong> {
    let given = [t.torque.is_some(), t.force.is_some(), t.power.is_some()];
    if given.iter().filter(|g| **g).count() != 1 {
        return wrong(
            key,
            "traction must be a torque, a force or a power",
            "give exactly one of `torque`, `force`, `power`",
        );
    }
    let quantity = match given {
        [true, ..] => Quantity::Torque,
        [_, true, _] => Quantity::Force,
        _ => Quantity::Power,
    };
    unit(key, &t.unit, quantity)?;
    sign(key, t.sign.get())?;
    if t.torque
        .as_ref()
        .is_some_and(|motors| motors.is_empty() || motors.len() > MAX_DRIVES)
    {
        return wrong(
            format!("{key}.torque"),
            "the number of motors is not valid",
            format!("1 to {MAX_DRIVES} columns"),
        );
    }
    if t.gear_ratio.is_some() && t.torque.is_none() {
        return wrong(
            format!("{key}.gear_ratio"),
            "a gear ratio belongs to a torque",
            "leave this out",
        );
    }
    if t.efficiency.is_some() && t.power.is_none() {
        return wrong(
            format!("{key}.efficiency"),
            "this efficiency belongs to a power",
            "use `nominal.efficiency` for the motors",
        );
    }
    if t.efficiency.is_some_and(|e| e.get() == 0.0) {
        return wrong(
            format!("{key}.efficiency"),
            "this leaves no force at the rims",
            "a share above zero",
        );
    }
    Ok(())
}

fn references(r: &References) -> Result<(), Wrong> {
    for (key, slope) in [
        ("reference.slope", &r.slope),
        ("reference.effective_slope", &r.effective_slope),
    ] {
        slope_reference(key, slope.as_ref())?;
    }
    for (key, way, quantity) in [
        ("reference.speed", &r.speed, Quantity::Speed),
        ("reference.distance", &r.distance, Quantity::Length),
    ] {
        way.iter().try_for_each(|w| unit(key, &w.unit, quantity))?;
    }
    if r.speed.is_some() && r.distance.is_some() {
        return wrong(
            "reference.distance",
            "the map also has a reference of the speed",
            "give only one of `speed` and `distance`",
        );
    }
    mass_reference(r)
}

fn slope_reference(key: &str, slope: Option<&SlopeReference>) -> Result<(), Wrong> {
    if let Some(s) = slope {
        let given = [s.deg.is_some(), s.column.is_some(), s.altitude.is_some()];
        if given.iter().filter(|g| **g).count() != 1 {
            return wrong(
                key,
                "a slope is a constant, a column, or comes from altitude and distance",
                "give exactly one of `deg`, `column`, `altitude`",
            );
        }
        match (&s.column, &s.unit) {
            (Some(_), Some(u)) => unit(key, u, Quantity::Slope)?,
            (Some(_), None) => {
                return wrong(
                    format!("{key}.unit"),
                    "the unit of the slope is missing",
                    Quantity::Slope.names(),
                );
            }
            (None, Some(_)) => {
                return wrong(
                    format!("{key}.unit"),
                    "only a column has a unit here",
                    "leave this out",
                );
            }
            (None, None) => {}
        }
        if let Some(a) = &s.altitude {
            unit(&format!("{key}.altitude"), &a.unit, Quantity::Length)?;
            let given = [&a.distance, &a.latitude, &a.longitude].map(Option::is_some);
            if given != [true, false, false] && given != [false, true, true] {
                return wrong(
                    format!("{key}.altitude"),
                    "an altitude needs a distance or positions",
                    "give either `distance`, or `latitude` and `longitude`",
                );
            }
        }
    }
    Ok(())
}

fn mass_reference(r: &References) -> Result<(), Wrong> {
    if let Some(m) = &r.mass {
        let key = "reference.mass";
        match (&m.kg, &m.steps) {
            (Some(_), None) => {}
            (None, Some(steps)) => {
                let ascending = steps
                    .windows(2)
                    .all(|w| matches!(w, [a, b] if a.at_s.get() < b.at_s.get()));
                if steps.is_empty() || !ascending {
                    return wrong(
                        format!("{key}.steps"),
                        "the steps are missing, or not in the order of time",
                        "`[{at_s: 0, kg: …}, {at_s: …, kg: …}]`",
                    );
                }
            }
            _ => {
                return wrong(
                    key,
                    "a mass is a constant, or changes in steps",
                    "give exactly one of `kg` and `steps`",
                );
            }
        }
    }
    Ok(())
}

fn sign(key: &str, sign: f64) -> Result<(), Wrong> {
    match sign.abs() == 1.0 {
        true => Ok(()),
        false => wrong(
            format!("{key}.sign"),
            format!("{sign} is not a sign"),
            "use 1 or -1; write a factor as an expression",
        ),
    }
}

fn unit(key: &str, unit: &UnitName, quantity: Quantity) -> Result<(), Wrong> {
    match quantity.unit(unit.as_str()) {
        Some(_) => Ok(()),
        None => wrong(
            format!("{key}.unit"),
            format!("`{}` is not a unit of {}", unit.as_str(), quantity.words()),
            format!("one of: {}", quantity.names()),
        ),
    }
}
