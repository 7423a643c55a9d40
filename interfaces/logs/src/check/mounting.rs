//! Checks of the mounting of the IMU: a box that is not turned to the vehicle, axes of the gyro that are exchanged, an
//! accelerometer that drifts.

use super::series::Series;
use super::statistics::{FittedLine, line};
use super::verdict::{Check, Verdict, check, norm};
use crate::drive::{Plan, axes, tells_mount};
use crate::identify::{ForceWindow, MIN_WINDOWS, OVERLAP, STRAIGHT_RADPS};
use crate::map::Map;
use crate::notation::STANDARD_GRAVITY_MPS2 as G;
use monorig_estimators::api::signals::Measurand;
use nalgebra::{Matrix3, Vector3};

/// Least correlation for a verdict.
pub(super) const MIN_CORRELATION: f64 = 0.5;
/// Least limit of a mean that should be zero, m/s²; else three standard deviations of the map's bias.
const MIN_OFF_MPS2: f64 = 0.3;
const BIAS_SDS: f64 = 3.0;
/// Largest drift from the first third of a log to the last, m/s².
const MAX_DRIFT_MPS2: f64 = 0.15;
/// Correlation with which another axis of the gyro shows the change of the slope.
const CLEAR: f64 = 0.8;
/// Fewest seconds of |f|, and of changes of the speed; least standard deviation of these, m/s².
const MIN_SECONDS: usize = 10;
const MIN_ACCEL_SD: f64 = 0.05;
/// Windows of a change of the slope: 5 s.
pub(super) const SLOPE_STEP: usize = 10 * OVERLAP;
/// Windows of a second.
const SECOND: usize = 2 * OVERLAP;
/// Least standard deviation of the change of the slope, rad.
const MIN_SLOPE_SD: f64 = 0.01;

/// All of them.
pub(super) fn all(map: &Map, plan: &Plan, series: &Series) -> Vec<Check> {
    let mut all = Vec::new();
    let has = |m| map.file.channels.vector(m).is_some();
    if !has(Measurand::SpecificForce) {
        return all;
    }
    all.extend(axes_by_log(map, series).map(|(axes, correlation)| {
        let why = format!("gravity and the change of the speed show `axes: [{axes}]`; a gyro in the same box has the same axes");
        let what = "correlation of another axis, or direction, with the change of the speed";
        check(what, correlation, "", "the forward axis has the largest correlation", Verdict::Bad(why))
    }));
    if !tells_mount(map) && !map.has_slope() {
        let why = "the map has no reference and no mount: the slope may be 3° off; use `mount_deg`, `calibrate`, or `monorig log calibrate --known slope`";
        all.push(check(
            "pitch of the box",
            f64::NAN,
            "",
            "told",
            Verdict::Unknown(why.into()),
        ));
    }
    let there = |axis: usize| !plan.absent.contains(&(Measurand::SpecificForce, axis));
    let limit = plan.vehicle.accel_bias_sd_mps2.unwrap_or(0.0) * BIAS_SDS;
    let limit = limit.max(MIN_OFF_MPS2);
    let off = |w: &ForceWindow| w.specific_force[0] - w.acceleration - G * w.sin;
    let slopes = series.balance.windows.iter().filter(|w| off(w).is_finite());
    let pitched: Vec<&ForceWindow> = slopes.collect();
    if pitched.len() >= MIN_WINDOWS && there(0) {
        let bad = "the box is pitched against the vehicle, or its bias is larger than in the map: use `mount_deg` or `monorig log calibrate --apply`";
        let what = "specific force forward beyond speed and reference slope, mean";
        all.push(mean_is_zero(
            what,
            pitched.iter().map(|w| off(w)),
            limit,
            bad,
        ));
        all.push(drift(
            "the same, last third minus first",
            &pitched.iter().map(|w| off(w)).collect::<Vec<_>>(),
        ));
    }
    let straight = |w: &&ForceWindow| w.rate[2].is_nan() || w.rate[2].abs() <= STRAIGHT_RADPS;
    let rolled: Vec<f64> = series
        .balance
        .windows
        .iter()
        .filter(straight)
        .map(|w| w.specific_force[1])
        .filter(|f| f.is_finite())
        .collect();
    if rolled.len() >= MIN_WINDOWS && there(1) {
        let bad = "the box is rolled against the vehicle, or the road is banked: use `mount_deg`";
        let what = "specific force to the left on a straight, mean";
        all.push(mean_is_zero(
            what,
            rolled.into_iter(),
            limit.max(2.0 * MIN_OFF_MPS2),
            bad,
        ));
    }
    if (0..3).all(there) {
        let sizes = series
            .balance
            .windows
            .iter()
            .map(|w| norm(w.specific_force));
        let sizes: Vec<f64> = sizes.filter(|f| f.is_finite()).collect();
        if sizes.len() >= MIN_WINDOWS {
            all.push(drift("|f|, last third minus first", &sizes));
        }
    }
    if has(Measurand::AngularRate) {
        all.extend(exchanged(&series.balance.windows));
    }
    all
}

fn mean_is_zero(what: &str, values: impl Iterator<Item = f64>, limit: f64, bad: &str) -> Check {
    let (n, sum) = values.fold((0.0, 0.0), |(n, s), x| (n + 1.0, s + x));
    let mean: f64 = sum / n;
    let verdict = match mean.abs() < limit {
        true => Verdict::Good,
        false => Verdict::Bad(bad.to_owned()),
    };
    check(
        what,
        mean,
        "m/s²",
        &format!("-{limit:.2} to {limit:.2}"),
        verdict,
    )
}

/// The median of the last third minus that of the first.
fn drift(what: &str, values: &[f64]) -> Check {
    let third = values.len() / 3;
    let median = |part: Option<&[f64]>| {
        let mut sorted = part.unwrap_or_default().to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
    };
    let first = median(values.get(..third));
    let drift = median(values.get(values.len() - third..)) - first;
    let verdict = match drift.abs() < MAX_DRIFT_MPS2 {
        true => Verdict::Good,
        false => Verdict::Bad("an axis of the accelerometer drifts: warming up, or broken".into()),
    };
    let good = format!("-{MAX_DRIFT_MPS2} to {MAX_DRIFT_MPS2}");
    check(what, drift, "m/s²", &good, verdict)
}

/// The change of the slope over so many windows, and by how much the gyro has turned about an axis meanwhile: nose up
/// is against the axis to the left. The slope is the reference's, else that of specific force and wheels, sin θ = (f −
/// dv/dt)/g, each the mean over a second.
pub(super) fn slope_change(windows: &[ForceWindow], axis: usize, step: usize) -> FittedLine {
    let slope = |w: &ForceWindow| {
        let sine = match w.sin.is_nan() {
            true => (w.specific_force[0] - w.acceleration) / G,
            false => w.sin,
        };
        sine.clamp(-1.0, 1.0).asin()
    };
    let rate = |w: &ForceWindow| w.rate.get(axis).copied().unwrap_or(f64::NAN);
    let pairs = windows.windows(step + 1).step_by(OVERLAP).filter_map(|w| {
        let (a, b, next) = (w.first()?, w.last()?, w.get(1)?);
        let (n, hop_s) = (w.len(), next.t_s - a.t_s);
        // windows without a gap between them
        if b.t_s - a.t_s > 1.01 * hop_s * step as f64 {
            return None;
        }
        let of_ends = |part: Option<&[ForceWindow]>| {
            let part = part.unwrap_or_default();
            part.iter().map(slope).sum::<f64>() / part.len() as f64
        };
        let change = of_ends(w.get(n - SECOND..)) - of_ends(w.get(..SECOND));
        // the means at both ends are those of a rate whose weight rises and falls over them
        let weight = |i: usize| {
            let from_end = i.min(n - 1 - i) as f64 + 0.5;
            (from_end / SECOND as f64).min(1.0)
        };
        let turned = w.iter().enumerate().map(|(i, w)| weight(i) * rate(w));
        Some((change, turned.sum::<f64>() * hop_s))
    });
    line(pairs)
}

/// The change of the specific force along an axis from second to second against that of the acceleration, with the
/// same weights: there is little of the slope in it.
pub(super) fn force_on_acceleration(windows: &[ForceWindow], axis: usize) -> FittedLine {
    let pairs = windows.windows(SECOND + 1).step_by(OVERLAP);
    line(pairs.filter_map(|w| {
        let (a, b) = (w.first()?, w.last()?);
        let change = b.specific_force.get(axis)? - a.specific_force.get(axis)?;
        (b.t_s - a.t_s < 1.5).then_some((b.acceleration - a.acceleration, change))
    }))
}

/// The axes of the columns of the accelerometer where they are others than the map says, and the correlation of that
/// forward: up is gravity's, and forward that which follows the change of the speed from second to second.
pub(super) fn axes_by_log(map: &Map, series: &Series) -> Option<(String, f64)> {
    let windows = &series.balance.windows;
    let force = |w: &ForceWindow| Vector3::from(w.specific_force);
    let known = windows.iter().map(force).filter(|f| f.norm().is_finite());
    let (sum, n) = known.fold((Vector3::zeros(), 0.0), |(sum, n), f| (sum + f, n + 1.0));
    let mean: Vector3<f64> = sum / n;
    let up = mean.iamax();
    if mean[up].abs() < 0.8 * G {
        return None;
    }
    let along = |axis: usize| force_on_acceleration(windows, axis);
    let level = (0..3).filter(|axis| *axis != up);
    let forward = level.max_by(|a, b| {
        let [a, b] = [a, b].map(|axis| along(*axis).correlation.abs());
        a.total_cmp(&b)
    })?;
    let FittedLine {
        correlation,
        n,
        sd_x,
        ..
    } = along(forward);
    if correlation.abs() < CLEAR || n < MIN_SECONDS || sd_x < MIN_ACCEL_SD {
        return None;
    }
    let unit = |axis: usize, sign: f64| Vector3::ith(axis, sign.signum());
    let (x, z) = (unit(forward, correlation), unit(up, mean[up]));
    let turn = Matrix3::from_columns(&[x, z.cross(&x), z]).transpose();
    if turn == Matrix3::identity() {
        return None;
    }
    let of_map = map.file.channels.vector(Measurand::SpecificForce)?.axes;
    let names = [("forward", "backward"), ("left", "right"), ("up", "down")];
    let columns = turn * axes(of_map);
    let names = columns.column_iter().map(|direction| {
        let (positive, negative) = names[direction.iamax()];
        if direction.sum() > 0.0 {
            positive
        } else {
            negative
        }
    });
    Some((names.collect::<Vec<_>>().join(", "), correlation))
}

/// Another axis of the gyro that shows the change of the slope, where that of the pitch does not; shown only where one
/// does.
fn exchanged(windows: &[ForceWindow]) -> Option<Check> {
    let [roll, pitch, yaw] = [0, 1, 2].map(|axis| slope_change(windows, axis, SLOPE_STEP));
    if pitch.n < 20 || pitch.sd_x < MIN_SLOPE_SD || pitch.correlation.abs() >= MIN_CORRELATION {
        return None;
    }
    let best = [("forward", roll), ("up", yaw)]
        .into_iter()
        .max_by(|a, b| a.1.correlation.abs().total_cmp(&b.1.correlation.abs()))?;
    (best.1.correlation.abs() > CLEAR).then(|| {
        check(
            "correlation of the pitch rate with the change of the slope",
            pitch.correlation,
            "",
            "0.5 or more",
            Verdict::Bad(format!(
                "axes of the gyro are exchanged: the axis {} shows the change with {:.2}",
                best.0, best.1.correlation
            )),
        )
    })
}
