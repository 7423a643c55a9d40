//! Checks of each channel by itself: rate, jitter, gaps, repeated stamps, share that counts, a value that stays; and its
//! lag against the wheels.

use super::lag::Lag;
use super::rules::check;
use super::series::{ChannelFigures, Series};
use super::{Check, Verdict};
use crate::drive::Target;
use monorig_estimators::api::signals::{Measurand, Shape};

/// Least rates, Hz: the filters are made for steps of a fast IMU, and hold what comes less often.
const MIN_IMU_HZ: f64 = 10.0;
const MIN_HZ: f64 = 2.0;
/// Largest share of stamps that are those of the sample before.
const MAX_DUPLICATES: f64 = 0.05;
/// Least share of the samples that count.
const MIN_VALID: f64 = 0.5;
/// A value that stays longer than this, s, and so many times longer than any other value did, is frozen. A motor may be
/// at its limit for some time.
const FROZEN_S: f64 = 3.0;
const FROZEN_TORQUE_S: f64 = 10.0;
const FROZEN_TIMES: f64 = 5.0;
/// Slower than this the vehicle may stand, m/s.
const MOVING_MPS: f64 = 0.1;
/// Largest lag, s, least correlation that shows one, and by how much it must be above that without a lag.
const MAX_LAG_S: f64 = 0.05;
const MIN_CORRELATION: f64 = 0.6;
const MIN_GAIN: f64 = 0.02;

/// All of them.
pub(super) fn all(series: &Series) -> Vec<Check> {
    let mut all: Vec<Check> = series.channels.iter().filter_map(rate).collect();
    all.extend(series.channels.iter().filter_map(|c| frozen(c, series)));
    let lags = [
        ("specific force", series.lags.force()),
        ("traction", series.lags.traction()),
    ];
    let lags = lags.into_iter().filter_map(|(name, l)| Some((name, l?)));
    all.extend(lags.map(|(name, lag)| lag_check(name, lag)));
    all
}

/// The name of a channel that is measured; none of a command.
fn name(target: Target) -> Option<String> {
    match target {
        Target::Measured(slot) => {
            let words = slot.measurand.name().replace('_', " ");
            Some(match slot.measurand.shape() {
                Shape::Vector | Shape::Scalar => words,
                Shape::PerDrive | Shape::Auxiliary => format!("{words} {}", slot.index + 1),
            })
        }
        Target::Force => Some("traction force".into()),
        Target::Power => Some("traction power".into()),
        Target::CommandTorque(_) | Target::CommandClamp | Target::CommandBrake => None,
    }
}

fn is_imu(target: Target) -> bool {
    let Target::Measured(slot) = target else {
        return false;
    };
    matches!(slot.measurand, Measurand::SpecificForce | Measurand::AngularRate)
}

fn is_used_for_motion(target: Target) -> bool {
    let wheel = |target| matches!(target, Target::Measured(slot) if slot.measurand == Measurand::WheelSpeed);
    is_imu(target) || wheel(target) || target.is_traction()
}

/// Rate, jitter, gaps, repeated stamps and share that counts, in a line.
fn rate(c: &ChannelFigures) -> Option<Check> {
    let name = name(c.target)?;
    let (stamps, rate) = (&c.stamps, &c.rate);
    if stamps.offered < 2 {
        return None;
    }
    let least = match (is_imu(c.target), is_used_for_motion(c.target)) {
        (true, _) => MIN_IMU_HZ,
        (_, true) => MIN_HZ,
        _ => 0.0,
    };
    let share = |n: u64| n as f64 / stamps.offered as f64;
    let valid = share(stamps.accepted);
    let verdict = match rate.rate_hz {
        r if r < least => Verdict::Bad("too slow for these estimators".into()),
        _ if share(stamps.duplicates) > MAX_DUPLICATES => Verdict::Bad(format!(
            "{:.1} % of its stamps are those of the sample before: rows that were written twice, or a clock that is too coarse",
            100.0 * share(stamps.duplicates)
        )),
        _ if valid < MIN_VALID => Verdict::Unknown(format!(
            "only {:.1} % of its samples count: `valid_if`, or empty columns",
            100.0 * valid
        )),
        _ => Verdict::Good,
    };
    let gaps = match rate.gaps {
        0 => "no gap".to_owned(),
        n => format!("{n} gaps of up to {:.2} s", rate.longest_gap_s),
    };
    let what = format!(
        "{name}: rate, with jitter {:.2} ms, {gaps}, {} stamps twice, {:.1} % valid",
        rate.jitter_ms,
        stamps.duplicates,
        100.0 * valid
    );
    let good = match least > 0.0 {
        true => format!("{least} or more"),
        false => "any".to_owned(),
    };
    Some(check(what, rate.rate_hz, "Hz", &good, verdict))
}

/// A channel whose value stays while the vehicle moves; shown only where it does.
fn frozen(c: &ChannelFigures, series: &Series) -> Option<Check> {
    let name = name(c.target).filter(|_| is_used_for_motion(c.target))?;
    let s = |ns: i64| ns as f64 * 1e-9;
    let (longest_s, second_s) = (s(c.stamps.longest_ns), s(c.stamps.second_ns));
    let least_s = match c.target.is_traction() {
        true => FROZEN_TORQUE_S,
        false => FROZEN_S,
    };
    if longest_s < least_s || longest_s < FROZEN_TIMES * second_s {
        return None;
    }
    let from_s = s(c.stamps.longest_from_ns);
    let within = |w: &&_| {
        let w: &crate::identify::ForceWindow = w;
        (from_s..from_s + longest_s).contains(&w.t_s)
    };
    let windows: Vec<_> = series.balance.iter().filter(within).collect();
    let moving = windows.iter().filter(|w| w.speed.abs() > MOVING_MPS).count();
    (2 * moving > windows.len()).then(|| {
        check(
            format!("{name}: longest time with one value while the vehicle moves, from {from_s:.1} s"),
            longest_s,
            "s",
            &format!("below {least_s}, or as others"),
            Verdict::Bad("it is frozen: its stamps go on, and its value does not".into()),
        )
    })
}

fn lag_check(name: &str, lag: Lag) -> Check {
    let verdict = match lag {
        l if l.correlation < MIN_CORRELATION => Verdict::Unknown(format!(
            "it does not go with the acceleration of the wheels (correlation {:.2})",
            l.correlation
        )),
        l if l.lag_s.abs() > MAX_LAG_S && l.correlation > l.at_none + MIN_GAIN => {
            let late = if l.lag_s > 0.0 { "it comes" } else { "the wheels come" };
            Verdict::Bad(format!(
                "{late} {:.0} ms late: `clocks: {{FILE: {{offset_s: …}}}}` of the late file; a mass is wrong by it",
                1e3 * l.lag_s.abs()
            ))
        }
        _ => Verdict::Good,
    };
    let range = format!("-{MAX_LAG_S} to {MAX_LAG_S}");
    check(format!("lag of the {name} against the wheels"), lag.lag_s, "s", &range, verdict)
}
