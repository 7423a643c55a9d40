//! The map with the found values: which keys get which values, and the file with them, its comments kept.

use super::{Parameter, ParameterKind};
use crate::drive::{Plan, axes, mount, turned};
use crate::map::{Map, edit};
use crate::notation::STANDARD_GRAVITY_MPS2 as G;
use monorig_estimators::api::signals::Measurand;
use monorig_sim::config::checked::{Finite, Positive};
use monorig_sim::error::Error;
use nalgebra::{Rotation3, Vector3};
use serde::Serialize;

/// Least standard deviations of the biases that are left, m/s² and rad/s: they drift.
const MIN_BIAS_SD: [f64; 2] = [0.01, 5e-4];

/// A key of a map and the value that it gets.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Applied {
    /// Path of the key, as `--set` takes it.
    pub key: String,
    /// Its value, as YAML.
    pub value: String,
    /// The parameter that was found, with its standard deviation.
    pub found: String,
}

/// Beginning of the name of the noise of a wheel speed.
const NOISE_OF_WHEELS: &str = "noise of the wheel speed";

/// Least change, in standard deviations, that is significant: the map keeps what it says.
const SEEN_SDS: f64 = 2.0;

/// Keys for a map, with the values found from its log that differ from the map by more than two standard deviations.
/// Adds the found values to the values of the map: what the map says already is not found again.
pub fn apply(map: &Map, found: &[Parameter]) -> Vec<Applied> {
    let file = &map.file;
    let vehicle = Plan::new(map).map(|plan| plan.vehicle);
    // what the map says of it; of what is left after the map has been applied nothing
    let said = |p: &Parameter| match (p.kind, &vehicle) {
        (ParameterKind::WheelRadius, Ok(v)) => v.wheel_radius_m,
        (ParameterKind::TorqueGain, _) => 1.0,
        (ParameterKind::RunningResistance, Ok(v)) => v.running_resistance,
        (ParameterKind::DragArea, Ok(v)) => v.road.map_or(0.0, |r| r.drag_area_m2),
        _ => 0.0,
    };
    let seen = |p: &&Parameter| (p.value - said(p)).abs() > SEEN_SDS * p.sd;
    let one = |kind: ParameterKind| found.iter().find(|p| p.kind == kind).filter(seen);
    let mut all = Vec::new();
    let mut add = |key: String, value: String, of: &[&Parameter]| {
        let words = of.iter().map(|p| {
            let found = format!("{} {} ± {} {}", p.name, short(p.value), short(p.sd), p.unit);
            found.trim_end_matches(" 1").to_owned()
        });
        let found = words.collect::<Vec<_>>().join(", ");
        all.push(Applied { key, value, found });
    };
    let gain = |old: Option<Positive>, k: f64| short(old.map_or(1.0, Positive::get) * k);
    if let Some(p) = one(ParameterKind::WheelRadius) {
        let nominal_m = said(p);
        add("nominal.wheel_radius_m".into(), short(p.value), &[p]);
        for (i, wheel) in file.channels.wheel_speed.iter().enumerate() {
            let key = format!("channels.wheel_speed[{i}].gain");
            add(key, gain(wheel.gain, p.value / nominal_m), &[p]);
        }
    }
    if let (Some(p), Some(traction)) = (one(ParameterKind::TorqueGain), &file.channels.traction) {
        let key = "channels.traction.gain".into();
        add(key, gain(traction.gain, p.value), &[p]);
    }
    if let Some(p) = one(ParameterKind::RunningResistance) {
        let key = "nominal.running_resistance".into();
        add(key, short(p.value), &[p]);
    }
    if let Some(p) = one(ParameterKind::DragArea) {
        add("nominal.drag_area_m2".into(), short(p.value), &[p]);
    }
    // the noise of each log is taken from it
    let noise = found.iter().find(|p| p.name.starts_with(NOISE_OF_WHEELS));
    if let Some(p) = noise.filter(|_| file.noise.is_none()) {
        add("noise".into(), "from-log".into(), &[p]);
    }
    if let Some(v) = file.channels.vector(Measurand::SpecificForce) {
        let key = |name: &str| format!("channels.specific_force.{name}");
        if let Some(p) = one(ParameterKind::Lean) {
            let lean = v.lean_deg_per_g.map_or(0.0, Finite::get) + p.value;
            add(key("lean_deg_per_g"), short(lean), &[p]);
        }
        if let Some(p) = one(ParameterKind::AccelerometerBias) {
            let bias = bias_of(
                map,
                Measurand::SpecificForce,
                Vector3::new(p.value, 0.0, 0.0),
            );
            add(key("bias"), bias, &[p]);
            let sd = p.sd.max(MIN_BIAS_SD[0]);
            add(key("bias_sd"), short(sd), &[p]);
        }
        let [pitch, roll] = [ParameterKind::Pitch, ParameterKind::Roll].map(one);
        let turns: Vec<&Parameter> = pitch.into_iter().chain(roll).collect();
        if !turns.is_empty() {
            let angle = |p: Option<&Parameter>| p.map_or(0.0, |p| p.value.to_radians());
            let more = turned(angle(roll), angle(pitch), 0.0);
            for measurand in [Measurand::SpecificForce, Measurand::AngularRate] {
                let Some(v) = file.channels.vector(measurand) else {
                    continue;
                };
                let key = format!("channels.{}.mount_deg", measurand.name());
                add(key, mount_of(more * mount(&v.mount_deg)), &turns);
            }
        }
        if let Some(p) = pitch {
            let sd = G * p.sd.to_radians();
            add(key("bias_sd"), short(sd.max(MIN_BIAS_SD[0])), &[p]);
        }
    }
    if file.channels.vector(Measurand::AngularRate).is_some() {
        let axes = [0, 1, 2].map(ParameterKind::GyroBias);
        let value = |kind: ParameterKind| one(kind).map_or(0.0, |p| p.value);
        let key = |name: &str| format!("channels.angular_rate.{name}");
        let largest = axes.iter().filter_map(|kind| one(*kind));
        let largest = largest.max_by(|a, b| a.value.abs().total_cmp(&b.value.abs()));
        if let Some(p) = largest {
            let bias = Vector3::from(axes.map(value));
            add(
                key("bias"),
                bias_of(map, Measurand::AngularRate, bias),
                &[p],
            );
        }
        // of all three axes: an axis whose bias is not seen is known by its standard deviation too
        let all = axes.map(|kind| found.iter().find(|p| p.kind == kind));
        if let [Some(a), Some(b), Some(c)] = all {
            let sd = a.sd.max(b.sd).max(c.sd).max(MIN_BIAS_SD[1]);
            add(key("bias_sd"), short(sd), &[largest.unwrap_or(b)]);
        }
    }
    all
}

/// Writes a map file with the new keys; `source` describes the drive on which they were found. Comments and layout
/// stay. The file is as it was, or it is whole.
pub fn write(map: &Map, applied: &[Applied], source: &str) -> Result<(), Error> {
    let edits = applied.iter().map(|a| edit::Edit {
        key: a.key.clone(),
        value: a.value.clone(),
        comment: format!("calibrated by {source}: {}", a.found),
    });
    edit::write(map, &edits.collect::<Vec<_>>())
}

/// The bias of the columns, in their unit: that of the map and what was found in the axes of the vehicle, SI.
fn bias_of(map: &Map, measurand: Measurand, found: Vector3<f64>) -> String {
    let Some(v) = map.file.channels.vector(measurand) else {
        return String::new();
    };
    let unit = crate::map::quantity(measurand).unit(v.unit.as_str());
    let factor = unit.map_or(1.0, |u| u.to_si(1.0));
    let turn = mount(&v.mount_deg).matrix() * axes(v.axes);
    let columns = turn.transpose() * found / factor;
    let old = v.bias.map_or([0.0; 3], |b| b.map(Finite::get));
    let new: Vec<String> = old
        .iter()
        .zip(columns.iter())
        .map(|(a, b)| short(a + b))
        .collect();
    format!("[{}]", new.join(", "))
}

/// The angles of a turn from box to vehicle, as a map has them.
fn mount_of(turn: Rotation3<f64>) -> String {
    let (roll, pitch, yaw) = turn.euler_angles();
    let angles =
        [("roll", roll), ("pitch", -pitch), ("yaw", yaw)].map(|(name, x)| (name, x.to_degrees()));
    let told = angles.iter().filter(|(_, x)| x.abs() > 1e-3);
    let told: Vec<String> = told
        .map(|(name, x)| format!("{name}: {}", short(*x)))
        .collect();
    format!("{{{}}}", told.join(", "))
}

/// A number with four significant digits.
fn short(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return "0".into();
    }
    let digits = (3 - x.abs().log10().floor() as i32).clamp(0, 12) as usize;
    let text = format!("{x:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}
