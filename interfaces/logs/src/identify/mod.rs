//! Parameters of vehicle and instruments from a log whose mass and slope are known: torque gain, running resistance,
//! lean and bias of the accelerometer, noise, and with a reference of the way the radius of the wheels. The force
//! balance of Liu et al. (2023, §2.2) regressed over windows of half a second.
//!
//! | file | what it holds |
//! |---|---|
//! | `tracks` | channels over time, without what was rejected |
//! | `windows` | weighted means over half a second, in which force and acceleration go together |
//! | `regression` | least squares over windows that overlap |
//! | `last` | the last values of channels, while they are not too old |
//! | `applied` | the map with what was found |
//! | `wheel_radius` `noise` `standing` | radius of the wheels, noise, the IMU while the vehicle stands |

mod applied;
mod last;
mod noise;
mod regression;
mod standing;
mod tracks;
mod wheel_radius;
mod windows;

pub use applied::{Applied, apply, write};
pub use standing::{Instrument, StandingAxis, standing};

pub(crate) use last::LastValues;
pub(crate) use noise::Noise;
pub(crate) use regression::{RegressionRow, diluted, regression};
pub(crate) use tracks::Tracks;
pub(crate) use windows::{ForceWindow, OVERLAP, WINDOW_S, Windows, drag_pressure, known};

use crate::drive::{Drive, Plan, Reference, Target, Way, calibrate};
use crate::map::Map;
use crate::notation::STANDARD_GRAVITY_MPS2 as G;
use monorig_estimators::api::signals::Measurand;
use monorig_sim::error::Error;
use nalgebra::{Vector1, Vector2};
use serde::Serialize;
use wheel_radius::Rolled;

/// Least known mass, of the nominal tare, and steepest known slope, rad.
const LEAST_OF_TARE: f64 = 0.8;
const MAX_SLOPE_RAD: f64 = 0.8;
/// Fewest windows of a regression: 10 s of them.
pub(crate) const MIN_WINDOWS: usize = 19 * OVERLAP + 1;
/// Fewest windows in which the vehicle stands, for the bias of the gyro: 3 s.
const MIN_STANDING: usize = 5 * OVERLAP + 1;
/// A drag area is found where its standard deviation is below this share of the nominal one.
const MAX_DRAG_SD: f64 = 0.5;
/// Largest lean of a vehicle, or error of scale, deg/g; it is found where its standard deviation is below half of it.
const MAX_LEAN: f64 = 6.0;
/// Forward a larger mean is the pitch of the box and no bias, m/s²; to the left one twice as large: roads have a crown.
const MAX_BIAS_MPS2: f64 = 0.15;
/// Largest angular rate on a straight, rad/s.
pub(crate) const STRAIGHT_RADPS: f64 = 0.05;

/// A found parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parameter {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its standard deviation: residuals, their correlation from window to window, and that of the known mass and
    /// slope.
    pub sd: f64,
    /// Unit of both.
    pub unit: &'static str,
    /// Its key in a map, or its meaning for the vehicle.
    pub meaning: &'static str,
    /// Its kind.
    #[serde(skip)]
    pub kind: ParameterKind,
}

/// The kind of a parameter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ParameterKind {
    /// Radius of the wheels.
    WheelRadius,
    /// Gain of the traction.
    TorqueGain,
    /// Running resistance.
    RunningResistance,
    /// Drag coefficient times frontal area.
    DragArea,
    /// Lean of the accelerometer.
    Lean,
    /// Bias of the accelerometer, forward.
    AccelerometerBias,
    /// Pitch of the box, nose up.
    Pitch,
    /// Roll of the box, right side down.
    Roll,
    /// Bias of the gyro about an axis: 0 forward, 1 left, 2 up.
    GyroBias(usize),
    /// Noise, and parameters without a key in a map.
    #[default]
    Figure,
}

/// Name, unit, key in a map or meaning for the vehicle, and the values that there are, of a kind of parameter.
type Told = (&'static str, &'static str, &'static str, [f64; 2]);

impl ParameterKind {
    #[rustfmt::skip]
    fn told(self) -> Told {
        let any = [f64::NEG_INFINITY, f64::INFINITY];
        let mount = "mount_deg of channels.specific_force and channels.angular_rate";
        match self {
            Self::WheelRadius => ("wheel radius", "m",
                "nominal.wheel_radius_m, where the wheel speeds of the log were made with the nominal one", any),
            Self::TorqueGain => ("torque gain", "1",
                "channels.traction.gain: force at the rims over the force by gear, efficiency and radius of the map (or the \
                 found radius)", [0.5, 2.0]),
            Self::RunningResistance => ("running resistance", "1", "nominal.running_resistance", [0.0, 1.0]),
            Self::DragArea => ("drag area", "m2", "nominal.drag_area_m2", [0.0, 20.0]),
            Self::Lean => ("lean", "deg/g",
                "channels.specific_force.lean_deg_per_g; an error of scale has the same effect", [-MAX_LEAN, MAX_LEAN]),
            Self::AccelerometerBias => ("accelerometer bias", "m/s2",
                "channels.specific_force.bias forward; it includes the pitch of its mount times g", any),
            Self::Pitch => ("pitch of the box", "deg", mount, [-20.0, 20.0]),
            Self::Roll => ("roll of the box", "deg", mount, [-20.0, 20.0]),
            Self::GyroBias(axis) => (
                ["gyro bias forward", "gyro bias left", "gyro bias up"].get(axis).copied().unwrap_or_default(), "rad/s",
                "channels.angular_rate.bias: at standstill, else from the change of the slope", any),
            Self::Figure => ("", "", "standard deviation of a sample", any),
        }
    }

    /// A parameter of this kind.
    fn is(self, value: f64, sd: f64) -> Parameter {
        let (name, unit, meaning, _) = self.told();
        Parameter {
            name: name.into(),
            value,
            sd,
            unit,
            meaning,
            kind: self,
        }
    }
}

/// Finds the parameters of a log, and describes further parameters and what the log lacks for them. `suspect` says what
/// is wrong with the reference slope of the windows, whose standard deviation is given in rad, and why.
pub(crate) fn parameters(
    map: &Map,
    suspect: impl FnOnce(&Windows, f64) -> Option<(String, String)>,
) -> Result<(Vec<Parameter>, Vec<String>), Error> {
    let mut plan = Plan::new(map)?;
    calibrate(map, &mut plan)?;
    let mut seen = Seen::default();
    let mut balance = windows(map, &plan, &mut seen)?;
    if let Some((what, why)) = suspect(&balance, seen.slope_sd) {
        let what = format!("{}, and not a parameter of the vehicle", what.trim_end());
        return Err(map.error("reference.slope", what, why));
    }
    let (mut found, mut lacks) = (Vec::new(), Vec::new());
    let radius = radius_ratio(map, &seen)?;
    if let Some((ratio, sd)) = radius {
        let nominal_m = plan.vehicle.wheel_radius_m;
        found.push(ParameterKind::WheelRadius.is(ratio * nominal_m, sd * nominal_m));
        // what follows is with this radius: speeds are larger by it, and the force of the same torque smaller
        for w in &mut balance.windows {
            w.acceleration *= ratio;
            w.speed *= ratio;
            w.speed_squared *= ratio * ratio;
            w.force_n /= ratio;
        }
    }
    match drive_parameters(&plan, &balance, &seen, radius) {
        Ok(more) => found.extend(more),
        Err(why) => lacks.push(format!("torque gain and running resistance: {why}")),
    }
    let is_turned = map
        .file
        .channels
        .vector(Measurand::SpecificForce)
        .is_some_and(|v| v.calibrate.is_some());
    match accelerometer_parameters(&balance, &seen, is_turned) {
        Ok(more) => found.extend(more),
        Err(why) => lacks.push(format!("bias and mount of the accelerometer: {why}")),
    }
    found.extend(gyro_parameters(&balance));
    if found.is_empty() {
        let why = format!("no parameter can be found: {}", lacks.join("; "));
        return Err(map.error(
            "",
            why,
            "use a longer drive, or more of its channels in the map",
        ));
    }
    found.retain(|p| {
        let (.., [low, high]) = p.kind.told();
        let is_found = p.sd <= 0.25 * (high - low);
        if !is_found {
            let (name, value, sd, unit) = (&p.name, p.value, p.sd, p.unit);
            lacks.push(format!(
                "{name}: {value:.3} ± {sd:.3} {unit} is too uncertain"
            ));
        }
        is_found
    });
    for p in &mut found {
        let (.., [low, high]) = p.kind.told();
        let nearest = p.value.clamp(low, high);
        if (p.value - nearest).abs() > 2.0 * p.sd {
            let what = format!(
                "{} {:.3} ± {:.3} {} cannot be",
                p.name, p.value, p.sd, p.unit
            );
            let help = format!(
                "expected {low} to {high}: `monorig log check` finds wrong units, signs and lags"
            );
            return Err(map.error("", what, help));
        }
        p.value = nearest;
    }
    found.extend(seen.noise.figures().into_iter().map(|figure| Parameter {
        name: format!("noise of the {}", figure.channel),
        value: figure.sd,
        sd: figure.sd_of_sd,
        unit: figure.unit,
        meaning: "standard deviation of a sample",
        kind: ParameterKind::Figure,
    }));
    Ok((found, lacks))
}

/// The radius of the wheels over the nominal one, and its standard deviation; none without a reference of the way.
fn radius_ratio(map: &Map, seen: &Seen) -> Result<Option<(f64, f64)>, Error> {
    let Some(rolled) = &seen.rolled else {
        return Ok(None);
    };
    rolled.ratio().map(Some).ok_or_else(|| {
        let help = "use a reference that covers at least four times 5 m in one stretch";
        let why = "too short a distance has both wheel speeds and a reference";
        map.error("reference", why, help)
    })
}

/// Torque gain, running resistance and, of a road vehicle whose speeds differ, the drag area, by the force balance
/// along the track while the vehicle moves; else what the log lacks.
fn drive_parameters(
    plan: &Plan,
    balance: &Windows,
    seen: &Seen,
    radius: Option<(f64, f64)>,
) -> Result<Vec<Parameter>, String> {
    let vehicle = &plan.vehicle;
    let known = |w: &&ForceWindow| {
        let all = [w.force_n, w.sin_effective, w.against];
        w.moves && all.iter().all(|x| x.is_finite()) && (w.mass_kg.is_finite() || !seen.has_mass)
    };
    let moving: Vec<&ForceWindow> = balance.windows.iter().filter(known).collect();
    let length_s = balance.longest_s;
    let needed = |w: &ForceWindow| {
        (w.mass_kg + vehicle.rotating_mass_kg) * w.acceleration + w.mass_kg * G * w.sin_effective
    };
    let weight = |w: &ForceWindow| -w.mass_kg * G * w.against;
    let nominal_m2 = vehicle.road.map_or(0.0, |r| r.drag_area_m2);
    let lacks = || match plan.targets().any(Target::is_traction) {
        false => "these need `channels.traction`".to_owned(),
        true => too_few(
            moving.len(),
            "speed, traction, slope and, where it is known, mass while the vehicle moves one way and does not brake",
        ),
    };
    if !seen.has_mass {
        // gain · force = mass · (a + g sin θ) + resistance · mass · g cos θ: only ratios are seen
        let row = |w: &&ForceWindow| {
            let columns = Vector2::new(w.acceleration + G * w.sin_effective, G * w.against);
            let drag_n = nominal_m2 * drag_pressure(w, vehicle);
            (
                w.t_s,
                columns,
                w.force_n - drag_n - vehicle.rotating_mass_kg * w.acceleration,
            )
        };
        let rows: Vec<_> = moving.iter().map(row).collect();
        let fit = regression(&rows, MIN_WINDOWS, length_s).filter(|f| f.value[0] > 3.0 * f.sd[0]);
        let f = fit.ok_or_else(lacks)?;
        let resistance = f.value[1] / f.value[0];
        let sd = (f.sd[1] / f.value[0]).hypot(resistance * f.sd[0] / f.value[0]);
        return Ok(vec![
            ParameterKind::RunningResistance.is(resistance, sd.hypot(seen.slope_sd)),
            Parameter {
                name: "mass over torque gain".into(),
                unit: "kg",
                meaning: "the total mass if the torque gain is 1; `--known mass,slope` finds the gain",
                ..ParameterKind::Figure.is(f.value[0], f.sd[0])
            },
        ]);
    }
    let fit = |drag_m2: f64| {
        let row = move |w: &&ForceWindow| {
            let drag = drag_pressure(w, vehicle);
            let columns = Vector2::new(w.force_n, weight(w));
            (w.t_s, columns, needed(w) + drag_m2 * drag, -drag)
        };
        moving.iter().map(row)
    };
    let drag = fit(0.0).map(|(t, h, y, drag)| (t, h.push(drag), y));
    let drag = regression(&drag.collect::<Vec<_>>(), MIN_WINDOWS, length_s);
    let drag = drag.filter(|f| vehicle.road.is_some() && f.sd[2] < MAX_DRAG_SD * nominal_m2);
    let all = match drag {
        Some(f) => [0, 1, 2].map(|i: usize| (f.value[i], f.sd[i])).to_vec(),
        None => {
            let rows: Vec<_> = fit(nominal_m2).map(|(t, h, y, _)| (t, h, y)).collect();
            let f = regression(&rows, MIN_WINDOWS, length_s).ok_or_else(lacks)?;
            [0, 1].map(|i: usize| (f.value[i], f.sd[i])).to_vec()
        }
    };
    let mean_mass = moving.iter().map(|w| w.mass_kg).sum::<f64>() / moving.len() as f64;
    let mass_sd = seen.mass_sd / mean_mass;
    let radius_sd = radius.map_or(0.0, |(ratio, sd)| sd / ratio);
    let kinds = [
        (ParameterKind::TorqueGain, mass_sd.hypot(radius_sd), 0.0),
        (ParameterKind::RunningResistance, 0.0, seen.slope_sd),
        (ParameterKind::DragArea, mass_sd, 0.0),
    ];
    let each = kinds.into_iter().zip(all);
    Ok(each
        .map(|((kind, share, more), (value, sd))| {
            kind.is(value, sd.hypot(value * share).hypot(more))
        })
        .collect())
}

/// Time that so many windows cover, s.
pub(crate) fn seconds_of(windows: usize) -> f64 {
    (windows as f64 * WINDOW_S / OVERLAP as f64).round()
}

fn too_few(windows: usize, what: &str) -> String {
    let [has, least] = [windows, MIN_WINDOWS].map(seconds_of);
    format!(
        "{has} s of this log have {what}; at least {least} s, with forces that differ, are needed"
    )
}

/// Lean and bias of the accelerometer, by its specific force along the vehicle, and pitch and roll of its box where
/// they are seen and the map does not find them itself (`is_turned`); else what the log lacks.
fn accelerometer_parameters(
    balance: &Windows,
    seen: &Seen,
    is_turned: bool,
) -> Result<Vec<Parameter>, String> {
    let (windows, length_s) = (balance.windows.iter(), balance.longest_s);
    let rows: Vec<_> = windows
        .clone()
        .map(|w| {
            let columns = Vector2::new(windows::expected_force(w), 1.0);
            (w.t_s, columns, w.specific_force[0])
        })
        .filter(|(_, h, y)| h.x.is_finite() && y.is_finite())
        .collect();
    let mean = |rows: Vec<(f64, f64)>| {
        let rows: Vec<_> = rows
            .iter()
            .map(|(t, y)| (*t, Vector1::new(1.0), *y))
            .collect();
        let fit = regression(&rows, MIN_WINDOWS, length_s)?;
        Some((fit.value[0], fit.sd[0]))
    };
    let to_deg = 180.0 / std::f64::consts::PI;
    let mut found = Vec::new();
    let fit = regression(&rows, MIN_WINDOWS, length_s);
    let diluted = diluted(rows.iter().map(|(_, h, _)| h.x), G * seen.slope_sd);
    // the map takes it off what was measured: its share of that
    let lean = fit.map(|f| {
        let share = f.value[0].max(0.1).recip();
        let sd = f.sd[0].hypot(diluted) * share * share;
        ((1.0 - share) * to_deg, sd * to_deg, f)
    });
    let lean = lean.filter(|(_, sd, _)| *sd < 0.5 * MAX_LEAN);
    let (bias, sd) = match lean {
        Some((value, sd, fit)) => {
            found.push(ParameterKind::Lean.is(value, sd));
            (fit.value[1], fit.sd[1])
        }
        None => {
            let off = rows.iter().map(|(t, h, y)| (*t, y - h.x)).collect();
            mean(off).ok_or_else(|| too_few(rows.len(), "specific force, speed and slope"))?
        }
    };
    let sd = sd.hypot(G * seen.slope_sd);
    let straight = windows.filter(|w| w.rate[2].abs() < STRAIGHT_RADPS);
    let left = straight.map(|w| (w.t_s, w.specific_force[1]));
    let left = mean(left.filter(|(_, f)| f.is_finite()).collect());
    let turn = |(mean, sd): (f64, f64), least: f64, kind: ParameterKind| {
        let is_seen = !is_turned && mean.abs() > least + 2.0 * sd;
        let angle = (mean / G).clamp(-1.0, 1.0).asin();
        is_seen.then(|| kind.is(angle * to_deg, sd / G * to_deg))
    };
    let pitch = turn((bias, sd), MAX_BIAS_MPS2, ParameterKind::Pitch);
    found.push(pitch.unwrap_or_else(|| ParameterKind::AccelerometerBias.is(bias, sd)));
    found.extend(left.and_then(|left| turn(left, 2.0 * MAX_BIAS_MPS2, ParameterKind::Roll)));
    Ok(found)
}

/// Bias of the gyro about each axis while the vehicle stands; where it does not stand for 3 s, of the pitch alone, by
/// the change of the reference slope. None of a log that shows neither.
fn gyro_parameters(balance: &Windows) -> Vec<Parameter> {
    let windows = &balance.windows;
    let of = |i: usize, rows: Vec<RegressionRow<1>>, least: usize| {
        let fit = regression(&rows, least, balance.longest_s)?;
        Some(ParameterKind::GyroBias(i).is(fit.value[0], fit.sd[0]))
    };
    let rows = |i: usize, of: &dyn Fn(&ForceWindow, f64) -> Option<f64>| -> Vec<_> {
        let rate = |w: &ForceWindow| w.rate.get(i).copied().unwrap_or(f64::NAN);
        let values = windows
            .iter()
            .filter_map(|w| Some((w.t_s, of(w, rate(w))?)));
        values
            .filter(|(_, y)| y.is_finite())
            .map(|(t, y)| (t, Vector1::new(1.0), y))
            .collect()
    };
    let at_rest = |i| {
        of(
            i,
            rows(i, &|w, rate| w.stands.then_some(rate)),
            MIN_STANDING,
        )
    };
    let standing: Vec<Parameter> = (0..3).filter_map(at_rest).collect();
    if !standing.is_empty() {
        return standing;
    }
    // the nose goes up against the axis to the left
    let rows = rows(1, &|w, rate| Some(rate + w.slope_rate));
    of(1, rows, MIN_WINDOWS).into_iter().collect()
}

/// Figures of a log beside its windows.
#[derive(Default)]
struct Seen {
    noise: Noise,
    /// Standard deviations of the references, rad and kg.
    slope_sd: f64,
    mass_sd: f64,
    has_mass: bool,
    /// The way by the wheels beside that by the reference, if there is one.
    rolled: Option<Rolled>,
}

/// The windows of a log, with what is known of its references.
fn windows(map: &Map, plan: &Plan, seen: &mut Seen) -> Result<Windows, Error> {
    let mut drive = Drive::open(map, plan)?;
    let mut reference = Reference::load(map, drive.origin_ns())?;
    (seen.slope_sd, seen.mass_sd) = (reference.slope_sd_rad, reference.mass_sd_kg);
    seen.has_mass = reference.has_mass();
    seen.rolled = Way::load(map, drive.origin_ns())?.map(Rolled::new);
    let mut windows = Windows::default();
    let mut last = LastValues::default();
    while let Some(step) = drive.next(map)? {
        seen.noise.see(&step.z);
        last.see(&step.z, &plan.vehicle);
        if let Some(rolled) = &mut seen.rolled {
            rolled.see(step.t_ns, step.segment, last.speed());
        }
        let now = known(&mut reference, step.t_ns);
        let ([slope, _, mass_kg], tare_kg) = (now, plan.vehicle.tare_kg);
        if mass_kg < LEAST_OF_TARE * tare_kg {
            let what =
                format!("{mass_kg} kg is less than the vehicle without a load, {tare_kg} kg");
            return Err(map.error(
                "reference.mass",
                what,
                "use the mass of vehicle and load together",
            ));
        }
        if slope.abs() > MAX_SLOPE_RAD {
            let [slope, most] = [slope, MAX_SLOPE_RAD].map(f64::to_degrees);
            let what = format!("a reference slope of {slope:.1}° is steeper than any rail or road");
            return Err(map.error(
                "reference.slope",
                what,
                format!("-{most:.0} to {most:.0}°: is its unit right?"),
            ));
        }
        windows.see(&step, now, &plan.vehicle, &mut |_| {});
    }
    windows.finish(&plan.vehicle, &mut |_| {});
    Ok(windows)
}
