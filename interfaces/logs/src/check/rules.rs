//! The checks, one function each.

use super::mounting::{MIN_CORRELATION, SLOPE_STEP, force_on_acceleration, slope_change};
use super::series::Series;
use super::statistics::{FittedLine, line};
use super::verdict::{Check, Verdict, check, norm};
use crate::drive::{Plan, Target};
use crate::identify::{
    ForceWindow, MIN_WINDOWS as MIN_FORCE_WINDOWS, OVERLAP, drag_pressure, regression, seconds_of,
};
use crate::map::Map;
use crate::notation::STANDARD_GRAVITY_MPS2 as G;
use monorig_estimators::api::signals::Measurand;
use nalgebra::Vector2;

/// Fewest windows of a second for a verdict.
const MIN_WINDOWS: usize = 10;
/// Least standard deviation of the acceleration, m/s², and of the slope, rad, for a verdict.
const MIN_ACCEL_SD: f64 = 0.05;
const MIN_SLOPE_SD: f64 = 0.003;
/// Correlation from which a gain of f on dv/dt is sharp, and its range then.
const SHARP_CORRELATION: f64 = 0.9;
const SHARP_GAIN: [f64; 2] = [0.75, 1.33];
/// Windows of 2 s, over which noise changes as much as over 5 s, and a slope does not: by how much less; and a change
/// of the slope that is more than noise, rad.
const SHORT_SLOPE_STEP: usize = 4 * OVERLAP;
const CLEAR_GROWTH: f64 = 1.3;
const CLEAR_SLOPE_SD: f64 = 0.01;

/// All of them.
pub(super) fn all(map: &Map, plan: &Plan, series: &Series) -> Vec<Check> {
    let mut all = vec![channels(series)];
    let has = |m: Measurand| plan.targets().any(|x| x == Target::Measured(m.slot(0)));
    let (force, rate, wheels) = (
        has(Measurand::SpecificForce),
        has(Measurand::AngularRate),
        plan.wheels > 0,
    );
    if wheels && !series.balance.windows.iter().any(|w| w.speed.is_finite()) {
        let why =
            "no wheel speed has a sample in any second: check `valid_if`, or the column is empty";
        let verdict = Verdict::Bad(why.into());
        all.push(check(
            "seconds with a wheel speed",
            0.0,
            "s",
            "all",
            verdict,
        ));
    }
    if force {
        all.push(gravity(plan, series));
    }
    if force && wheels {
        all.push(force_gain(series));
    }
    if rate {
        all.extend(gyro_bias(plan, series));
    }
    if force && rate && wheels {
        all.push(gyro_gain(series));
    }
    if plan.wheels > 1 {
        all.push(axles(series));
    }
    let traction = plan.targets().any(Target::is_traction);
    if traction && force && wheels {
        all.push(implied_mass(plan, series));
    }
    all.push(lacking(map, force, rate, wheels, traction));
    all
}

/// Columns that the map names but the log does not have.
fn channels(series: &Series) -> Check {
    let verdict = match series.missing.as_slice() {
        [] if series.samples == 0 => Verdict::Bad(
            "no channel has a sample: check `valid_if`, or the columns are empty".into(),
        ),
        [] if series.seconds < MIN_WINDOWS as f64 => Verdict::Bad(format!(
            "{:.1} s of samples are too short for a check",
            series.seconds
        )),
        [] => Verdict::Good,
        missing => {
            let list: Vec<String> = missing
                .iter()
                .map(|(key, column)| format!("`{column}` of {key}"))
                .collect();
            Verdict::Bad(format!("not in the log: {}", list.join(", ")))
        }
    };
    let what = format!(
        "samples of all channels, in {} segments over {:.1} s",
        series.segments, series.seconds
    );
    check(
        what,
        series.samples as f64,
        "",
        "all columns are there",
        verdict,
    )
}

fn mean(values: impl Iterator<Item = f64>) -> (f64, usize) {
    let (sum, n) = values
        .filter(|x| x.is_finite())
        .fold((0.0, 0usize), |(s, n), x| (s + x, n + 1));
    (sum / n as f64, n)
}

/// The windows in which the vehicle stands; all of a log without wheels.
fn standing<'a>(plan: &Plan, series: &'a Series) -> impl Iterator<Item = &'a ForceWindow> {
    let all = plan.wheels == 0;
    let windows = series.balance.windows.iter();
    windows.filter(move |w| all || w.stands)
}

/// |f| at rest is g.
fn gravity(plan: &Plan, series: &Series) -> Check {
    let size = |w: &ForceWindow| norm(w.specific_force);
    let mut at_rest = mean(standing(plan, series).map(size));
    let mut what = "|f| at rest";
    if at_rest.1 == 0 {
        (at_rest, what) = (
            mean(series.balance.windows.iter().map(size)),
            "|f|, the mean of a log without a rest",
        );
    }
    let (value, n) = at_rest;
    let verdict = match value {
        _ if n == 0 => Verdict::Unknown("the log has no sample".into()),
        v if (v - G).abs() < 0.3 => Verdict::Good,
        v if (v - 1.0).abs() < 0.05 => Verdict::Bad("it is in g: `unit: g`".into()),
        v if (v - 1000.0).abs() < 50.0 => Verdict::Bad("it is in mg: `unit: mg`".into()),
        v if v < 2.0 => Verdict::Bad(
            "it does not include gravity: this is an acceleration, not a specific force".into(),
        ),
        v if v > 50.0 => Verdict::Bad("it is far more than gravity: check the unit".into()),
        _ => Verdict::Bad("it is more than 0.3 m/s² off: check bias, scale and columns".into()),
    };
    check(what, value, "m/s²", "9.5 to 10.1", verdict)
}

fn too_little(line: &FittedLine, least: f64, what: &str) -> Option<Verdict> {
    if line.n < MIN_WINDOWS {
        return Some(Verdict::Unknown(format!("only {} s of samples", line.n)));
    }
    (line.sd_x < least).then(|| Verdict::Unknown(format!("{what} changes too little in this log")))
}

/// A gain with the verdict on it; where there is no correlation, that is what is shown.
fn gain_check(
    (what, unit, good): (&str, &'static str, &str),
    line: &FittedLine,
    missing: Verdict,
    of_gain: impl Fn(f64) -> Verdict,
) -> Check {
    match line.correlation.abs() < MIN_CORRELATION {
        true => {
            let what = format!("correlation behind the {what}");
            check(what, line.correlation, "", "0.5 or more", missing)
        }
        false => check(what, line.gain, unit, good, of_gain(line.gain)),
    }
}

/// Gain of the specific force on the measured acceleration: 1, of their changes from second to second. Where they go
/// together, which takes a log with little slope, the gain is sharp.
fn force_gain(series: &Series) -> Check {
    let line = force_on_acceleration(&series.balance.windows, 0);
    let [low, high] = match line.correlation.abs() > SHARP_CORRELATION {
        true => SHARP_GAIN,
        false => [0.5, 1.5],
    };
    let range = format!("{low} to {high}");
    let title = ("gain of f on dv/dt", "", range.as_str());
    if let Some(verdict) = too_little(&line, MIN_ACCEL_SD, "the speed") {
        return check(title.0, line.gain, title.1, title.2, verdict);
    }
    let missing = Verdict::Bad("the specific force forward does not follow the change of the speed: check axes, time and columns".into());
    gain_check(title, &line, missing, |gain| {
        match gain {
        g if (low..=high).contains(&g) => Verdict::Good,
        g if g < 0.0 => Verdict::Bad(
            "the sign is wrong: the box faces backwards, or the speed has the other sign".into(),
        ),
        g if (0.05..0.15).contains(&g) => Verdict::Bad("0.1: the specific force is in g".into()),
        g if (0.15..0.4).contains(&g) => Verdict::Bad("0.28: the speed is in km/h".into()),
        _ => Verdict::Bad(
            "the units of specific force and speed do not fit together (0.62 or 1.6: km/h and mph exchanged)"
                .into(),
        ),
    }
    })
}

/// Mean of the angular rate while the vehicle stands.
fn gyro_bias(plan: &Plan, series: &Series) -> Vec<Check> {
    let axis = |i: usize, name: &str| {
        let (bias, n) = mean(standing(plan, series).filter_map(|w| w.rate.get(i).copied()));
        let verdict = match bias.abs() {
            _ if n == 0 => Verdict::Unknown("the vehicle never stands for a second".into()),
            b if b < 0.01 => Verdict::Good,
            b if b < 0.3 => Verdict::Bad("the estimators need this bias: set `calibrate: {standing_s: …}`, or `bias_sd`".into()),
            _ => Verdict::Bad("it is far more than a bias: the unit may be deg/s instead of rad/s, or the vehicle turns".into()),
        };
        check(
            format!("bias of the gyro, {name}, at rest"),
            bias,
            "rad/s",
            "below 0.01",
            verdict,
        )
    };
    vec![axis(0, "forward"), axis(1, "left"), axis(2, "up")]
}

/// Gain of the gyro on the change of the slope over 5 s: 1.
fn gyro_gain(series: &Series) -> Check {
    let over = |step: usize| {
        let line = slope_change(&series.balance.windows, 1, step);
        // nose up is against the axis to the left
        FittedLine {
            gain: -line.gain,
            correlation: -line.correlation,
            ..line
        }
    };
    let (line, soon) = (over(SLOPE_STEP), over(SHORT_SLOPE_STEP));
    let title = (
        "gain of the gyro on the change of the slope",
        "",
        "0.5 to 1.5",
    );
    if let Some(verdict) = too_little(&line, MIN_SLOPE_SD, "the slope") {
        return check(title.0, line.gain, title.1, title.2, verdict);
    }
    // noise changes as much in two seconds as in five, a slope does not
    let is_slope = line.sd_x > CLEAR_SLOPE_SD && line.sd_x > CLEAR_GROWTH * soon.sd_x;
    let missing = match is_slope {
        true => Verdict::Bad("the slope changes, but the gyro does not show the change: check its axes, or the gyro is stuck".into()),
        false => Verdict::Unknown(
            "the change of the slope is not above the noise; if the log has hills, check the gyro's axes"
                .into(),
        ),
    };
    gain_check(title, &line, missing, |gain| match gain {
        g if (0.5..=1.5).contains(&g) => Verdict::Good,
        g if g < 0.0 => Verdict::Bad("the sign is wrong: an axis points the other way".into()),
        g if (28.0..110.0).contains(&g) => Verdict::Bad("57: the gyro is in deg/s".into()),
        _ => Verdict::Bad("check the gyro's unit and axes".into()),
    })
}

/// Wheels against each other: the largest ratio of a wheel to the mean of all.
fn axles(series: &Series) -> Check {
    let mut worst = (1.0, 0usize, 0usize);
    for (i, sums) in series.wheels.iter().enumerate() {
        let ratio = sums.own / sums.all;
        if sums.steps >= MIN_WINDOWS && (ratio - 1.0).abs() >= f64::abs(worst.0 - 1.0) {
            worst = (ratio, i + 1, sums.steps);
        }
    }
    let verdict = match worst {
        (_, 0, _) => Verdict::Unknown("the vehicle hardly moves".into()),
        (r, ..) if (0.97..=1.03).contains(&r) => Verdict::Good,
        (_, i, _) => Verdict::Bad(format!(
            "wheel {i} differs from the mean of all: check unit, radius and sign, or the wheel slips"
        )),
    };
    check(
        "a wheel's speed over the mean of all",
        worst.0,
        "",
        "0.97 to 1.03",
        verdict,
    )
}

/// The mass that traction and specific force imply, F − drag = m f + c sgn v, over the range that is thought possible.
/// Only where the vehicle moves, does not brake, and the samples of the traction count.
fn implied_mass(plan: &Plan, series: &Series) -> Check {
    let v = &plan.vehicle;
    let drag_m2 = v.road.map_or(0.0, |r| r.drag_area_m2);
    let known =
        |w: &&ForceWindow| w.moves && w.force_n.is_finite() && w.specific_force[0].is_finite();
    let moving: Vec<&ForceWindow> = series.balance.windows.iter().filter(known).collect();
    let force = |w: &ForceWindow| w.force_n - drag_m2 * drag_pressure(w, v);
    let alike = line(moving.iter().map(|w| (w.specific_force[0], force(w))));
    let rows: Vec<_> = moving
        .iter()
        .map(|w| (w.t_s, Vector2::new(w.specific_force[0], w.sign), force(w)))
        .collect();
    let [low, high] = v.mass_range_kg;
    let range = format!("{:.0} to {:.0}", 0.5 * low, 2.0 * high);
    let what = "mass by traction against specific force";
    let of_all = format!("{what}, of {} s without brake", seconds_of(moving.len()));
    let title = (of_all.as_str(), "kg", range.as_str());
    if let Some(verdict) = too_little(&alike, MIN_ACCEL_SD, "the force on the vehicle") {
        return check(title.0, alike.gain, title.1, title.2, verdict);
    }
    let fit = regression(&rows, MIN_FORCE_WINDOWS, series.balance.longest_s);
    let mass = fit.map_or(alike.gain, |fit| fit.value[0]);
    let missing = Verdict::Bad(
        "traction and motion do not fit together: check sign, time and columns".into(),
    );
    let shown = FittedLine {
        gain: mass,
        ..alike
    };
    gain_check(title, &shown, missing, |m| match m {
        m if m < 0.0 => Verdict::Bad("the sign is wrong: the torque has the other sign".into()),
        m if m > 2.0 * high || m < 0.5 * low => Verdict::Bad(
            "this mass is impossible: check gear ratio, unit and number of motors".into(),
        ),
        _ => Verdict::Good,
    })
}

/// Measurements that estimators lack.
fn lacking(map: &Map, force: bool, rate: bool, wheels: bool, traction: bool) -> Check {
    let mut lacks = Vec::new();
    if !wheels {
        lacks.push("without a wheel speed no estimator knows if the vehicle moves, and no estimator marks a mass valid");
    }
    if !traction {
        lacks.push("without traction no mass can be estimated: estimates stay at the nominal mass and are not marked valid, and slopes from the force balance are meaningless");
    }
    if !force {
        lacks.push("without the specific force slopes come from the force balance alone");
    }
    if !rate {
        lacks.push("without the angular rate slopes follow fast changes poorly");
    }
    let have = [force, rate, wheels, traction]
        .iter()
        .filter(|x| **x)
        .count();
    let verdict = match lacks.is_empty() {
        true => Verdict::Good,
        false => {
            let names: Vec<&str> = map.file.estimators.keys().map(String::as_str).collect();
            let of = if names.is_empty() {
                String::new()
            } else {
                format!(" ({})", names.join(", "))
            };
            Verdict::Unknown(format!("{}{of}", lacks.join("; ")))
        }
    };
    check(
        "specific force, angular rate, wheel speed, traction",
        have as f64,
        "of 4",
        "4",
        verdict,
    )
}
