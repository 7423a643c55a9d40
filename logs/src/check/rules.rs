//! The checks, one function each.

use super::series::{Series, WINDOW_S, Window};
use super::statistics::{FittedLine, line};
use super::{Check, Verdict};
use crate::drive::{Plan, Target};
use crate::map::Map;
use crate::notation::STANDARD_GRAVITY_MPS2 as G;
use monorig_estimators::api::signals::Measurand;

/// Fewest windows of a second for a verdict.
const MIN_WINDOWS: usize = 10;
/// Least standard deviation of the acceleration, m/s², and of the slope, rad, for a verdict.
const MIN_ACCEL_SD: f64 = 0.05;
const MIN_SLOPE_SD: f64 = 0.003;
/// Least correlation for a verdict.
const MIN_CORRELATION: f64 = 0.5;
/// Windows of the check of the gyro against the slope: the change over so many seconds.
const SLOPE_STEP: usize = 5;

/// All of them.
pub(super) fn all(map: &Map, plan: &Plan, series: &Series) -> Vec<Check> {
    let mut all = vec![channels(series)];
    let has = |m: Measurand| plan.targets().any(|x| x == Target::Measured(m.slot(0)));
    let (force, rate, wheels) = (
        has(Measurand::SpecificForce),
        has(Measurand::AngularRate),
        plan.wheels > 0,
    );
    if wheels && !series.windows.iter().any(|w| w.speed.is_finite()) {
        let why = "no wheel speed has a sample in any second: `valid_if`, or an empty column";
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
        all.push(gravity(series));
    }
    if force && wheels {
        all.push(force_gain(series));
    }
    if rate {
        all.extend(gyro_bias(series));
    }
    if force && rate && wheels {
        all.push(gyro_gain(series));
    }
    if plan.wheels > 1 {
        all.push(axles(series));
    }
    let traction = plan.targets().any(Target::is_traction);
    if traction && force && wheels {
        all.push(power(plan, series));
    }
    all.extend(series.spreads.iter().map(|s| {
        let (value, constant) = (s.at_an_end(), s.is_constant());
        let verdict = match (constant, value > 0.02 && s.n > 100 && s.clips) {
            _ if s.n <= 100 && s.clips => Verdict::Unknown(format!("only {} samples", s.n)),
            (true, _) if value == 0.0 => Verdict::Unknown(
                "it is zero all the time: the vehicle stands, or nothing is connected".into(),
            ),
            (true, _) => Verdict::Bad(
                "it never changes: a channel that is not connected, or the wrong column".into(),
            ),
            (_, true) => Verdict::Bad("it stays at an end of its range: clipped".into()),
            _ => Verdict::Good,
        };
        check(
            format!("{}: share at an end of its range", s.name),
            value,
            "",
            // wheels that stand are at an end of their range
            if s.clips {
                "below 0.02"
            } else {
                "not constant"
            },
            verdict,
        )
    }));
    all.push(lacking(map, force, rate, wheels, traction));
    all
}

fn check(
    what: impl Into<String>,
    value: f64,
    unit: &'static str,
    good: &str,
    verdict: Verdict,
) -> Check {
    Check {
        what: what.into(),
        value,
        unit,
        good: good.into(),
        verdict,
    }
}

/// Columns that the map names and the log does not have.
fn channels(series: &Series) -> Check {
    let verdict = match series.missing.as_slice() {
        [] if series.samples == 0 => {
            Verdict::Bad("no channel has a single sample: `valid_if`, or empty columns".into())
        }
        [] if series.seconds < MIN_WINDOWS as f64 => Verdict::Bad(format!(
            "{:.1} s of samples are too little to check anything",
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

fn norm(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn mean(values: impl Iterator<Item = f64>) -> (f64, usize) {
    let (sum, n) = values
        .filter(|x| x.is_finite())
        .fold((0.0, 0usize), |(s, n), x| (s + x, n + 1));
    (sum / n as f64, n)
}

/// The windows in which the vehicle stands; all of a log without wheels.
fn standing(series: &Series) -> impl Iterator<Item = &Window> {
    series.windows.iter().filter(|w| w.stands().unwrap_or(true))
}

/// |f| at rest is g.
fn gravity(series: &Series) -> Check {
    let mut at_rest = mean(standing(series).map(|w| norm(w.force)));
    let mut what = "|f| at rest";
    if at_rest.1 == 0 {
        (at_rest, what) = (
            mean(series.windows.iter().map(|w| norm(w.force))),
            "|f|, the mean of a log without a rest",
        );
    }
    let (value, n) = at_rest;
    let verdict = match value {
        _ if n == 0 => Verdict::Unknown("there is no sample".into()),
        v if (v - G).abs() < 0.3 => Verdict::Good,
        v if (v - 1.0).abs() < 0.05 => Verdict::Bad("it is in g: `unit: g`".into()),
        v if (v - 1000.0).abs() < 50.0 => Verdict::Bad("it is in mg: `unit: mg`".into()),
        v if v < 2.0 => {
            Verdict::Bad("gravity is not in it: an acceleration, not a specific force".into())
        }
        v if v > 50.0 => Verdict::Bad("far more than gravity: the unit".into()),
        _ => Verdict::Bad("more than 0.3 m/s² off: bias, scale, or the wrong columns".into()),
    };
    check(what, value, "m/s²", "9.5 to 10.1", verdict)
}

/// Acceleration over a window from the speeds of those around it.
fn acceleration(a: &Window, c: &Window) -> f64 {
    (c.speed - a.speed) / (2.0 * WINDOW_S)
}

fn too_little(line: &FittedLine, least: f64, what: &str) -> Option<Verdict> {
    if line.n < MIN_WINDOWS {
        return Some(Verdict::Unknown(format!("only {} s of samples", line.n)));
    }
    (line.sd_x < least).then(|| Verdict::Unknown(format!("{what} changes too little in this log")))
}

/// Gain of the specific force on the measured acceleration: 1. Of their changes from second to second, in which there
/// is little of the slope.
fn force_gain(series: &Series) -> Check {
    let line = line(series.windows.windows(4).filter_map(|w| match w {
        [a, b, c, d] if a.segment == d.segment => {
            let change = acceleration(b, d) - acceleration(a, c);
            Some((change, c.force[0] - b.force[0]))
        }
        _ => None,
    }));
    let verdict = too_little(&line, MIN_ACCEL_SD, "the speed").unwrap_or_else(|| match line.gain {
        _ if line.correlation.abs() < MIN_CORRELATION => {
            Verdict::Bad("the specific force forward does not follow the change of the speed: axes, time, or the wrong columns".into())
        }
        g if (0.5..=1.5).contains(&g) => Verdict::Good,
        g if g < 0.0 => Verdict::Bad("the wrong sign: the box faces backwards, or the speed counts the other way".into()),
        g if (0.05..0.15).contains(&g) => Verdict::Bad("0.1: the specific force is in g".into()),
        g if (0.15..0.4).contains(&g) => Verdict::Bad("0.28: the speed is in km/h".into()),
        _ => Verdict::Bad("the units of specific force and speed do not go together".into()),
    });
    check("gain of f on dv/dt", line.gain, "", "0.5 to 1.5", verdict)
}

/// Mean of the angular rate while the vehicle stands.
fn gyro_bias(series: &Series) -> Vec<Check> {
    let axis = |i: usize, name: &str| {
        let (bias, n) = mean(standing(series).filter_map(|w| w.rate.get(i).copied()));
        let verdict = match bias.abs() {
            _ if n == 0 => Verdict::Unknown("the vehicle never stands for a second".into()),
            b if b < 0.01 => Verdict::Good,
            b if b < 0.3 => Verdict::Bad("a bias that estimators must be told of: `calibrate: {standing_s: …}`, or `bias_sd`".into()),
            _ => Verdict::Bad("far more than a bias: deg/s taken for rad/s, or the vehicle turns".into()),
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

/// Gain of the gyro on the change of the slope that specific force and wheels show, sin θ = (f − dv/dt)/g: 1.
fn gyro_gain(series: &Series) -> Check {
    let slope: Vec<Option<(u32, f64, f64)>> = series
        .windows
        .windows(3)
        .map(|w| match w {
            [a, b, c] if a.segment == c.segment => {
                let sine = (b.force[0] - acceleration(a, c)) / G;
                (sine.abs() < 1.0).then(|| (b.segment, sine.asin(), -b.rate[1]))
            }
            _ => None,
        })
        .collect();
    let pairs = slope.windows(SLOPE_STEP + 1).filter_map(|w| {
        let all: Option<Vec<_>> = w.iter().copied().collect();
        let all = all?;
        let (first, last) = (all.first()?, all.last()?);
        // the rate of each second from the middle of the first to the middle of the last
        let ends = 0.5 * (first.2 + last.2);
        let turned = ends
            + all
                .iter()
                .skip(1)
                .take(SLOPE_STEP - 1)
                .map(|x| x.2)
                .sum::<f64>();
        (first.0 == last.0).then_some((last.1 - first.1, turned * WINDOW_S))
    });
    let line = line(pairs);
    let verdict = too_little(&line, MIN_SLOPE_SD, "the slope").unwrap_or_else(|| match line.gain {
        _ if line.correlation.abs() < MIN_CORRELATION => Verdict::Unknown(format!(
            "the change of the slope is not seen above noise (correlation {:.2}); if the log has hills: the gyro's axes",
            line.correlation
        )),
        g if (0.5..=1.5).contains(&g) => Verdict::Good,
        g if g < 0.0 => Verdict::Bad("the wrong sign: an axis points the other way".into()),
        g if (28.0..110.0).contains(&g) => Verdict::Bad("57: the gyro is in deg/s".into()),
        _ => Verdict::Bad("the gyro's unit or axes".into()),
    });
    check(
        "gain of the gyro on the change of the slope",
        line.gain,
        "",
        "0.5 to 1.5",
        verdict,
    )
}

/// Wheels against each other: the largest ratio of a wheel to the mean of all.
fn axles(series: &Series) -> Check {
    let wheels = series
        .windows
        .iter()
        .map(|w| w.wheels.len())
        .max()
        .unwrap_or(0);
    let mut worst = (1.0, 0usize, 0usize);
    for i in 0..wheels {
        let moving = series.windows.iter().filter(|w| w.speed.abs() > 0.1);
        let pairs: Vec<(f64, f64)> = moving
            .filter_map(|w| Some((w.speed, *w.wheels.get(i)?)))
            .filter(|(v, w)| v.is_finite() && w.is_finite())
            .collect();
        let (own, all) = pairs.iter().fold((0.0, 0.0), |(a, b), (v, w)| {
            (a + w * v.signum(), b + v.abs())
        });
        let ratio = own / all;
        if pairs.len() >= MIN_WINDOWS && (ratio - 1.0).abs() >= f64::abs(worst.0 - 1.0) {
            worst = (ratio, i + 1, pairs.len());
        }
    }
    let verdict = match worst {
        (_, 0, _) => Verdict::Unknown("the vehicle hardly moves".into()),
        (r, ..) if (0.97..=1.03).contains(&r) => Verdict::Good,
        (_, i, _) => Verdict::Bad(format!(
            "wheel {i} differs from the mean of all: unit, radius, sign, or it slips"
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

/// Power of the traction over the power that it becomes, m (f · v): the mass that it implies, over the range that is
/// thought possible.
fn power(plan: &Plan, series: &Series) -> Check {
    let v = &plan.vehicle;
    let force = |w: &Window| w.torque * v.gear_ratio * v.efficiency / v.wheel_radius_m;
    let moving = series.windows.iter().filter(|w| w.speed.abs() > 0.1);
    let line = line(moving.map(|w| (w.force[0] * w.speed, force(w) * w.speed)));
    let [low, high] = v.mass_range_kg;
    let verdict =
        too_little(&line, MIN_ACCEL_SD * 0.1, "the force on the vehicle").unwrap_or_else(|| {
            match line.gain {
                _ if line.correlation.abs() < MIN_CORRELATION => Verdict::Bad(
                    "traction and motion do not go together: sign, time, or the wrong columns"
                        .into(),
                ),
                m if m < 0.0 => {
                    Verdict::Bad("the wrong sign: the torque counts the other way".into())
                }
                m if m > 2.0 * high || m < 0.5 * low => Verdict::Bad(
                    "a mass that cannot be: gear ratio, unit, or number of motors".into(),
                ),
                _ => Verdict::Good,
            }
        });
    check(
        "mass by torque × speed against f × speed",
        line.gain,
        "kg",
        &format!("{:.0} to {:.0}", 0.5 * low, 2.0 * high),
        verdict,
    )
}

/// The measurements that estimators have to do without.
fn lacking(map: &Map, force: bool, rate: bool, wheels: bool, traction: bool) -> Check {
    let mut lacks = Vec::new();
    if !wheels {
        lacks.push("without a wheel speed no estimator knows whether the vehicle moves, and none marks a mass valid");
    }
    if !traction {
        lacks.push("without traction no mass can be found: estimates stay at the nominal mass and are not marked valid, slopes from the force balance are meaningless");
    }
    if !force {
        lacks.push("without the specific force slopes come from the force balance alone");
    }
    if !rate {
        lacks.push("without the angular rate slopes have no fast part");
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
        "of specific force, angular rate, wheel speed, traction there are",
        have as f64,
        "of 4",
        "4",
        verdict,
    )
}
