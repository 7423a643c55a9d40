//! Checks of each channel by itself: rate, jitter, gaps, repeated stamps, share that counts, a value that stays; and
//! its lag against the wheels.

use super::lag::Lag;
use super::series::{ChannelFigures, MOVING_MPS, Series};
use super::verdict::{ChannelReport, Check, Verdict, check};
use crate::drive::{ColumnRange, Target};
use monorig_estimators::api::signals::{Measurand, Shape};

/// Least rates, Hz: the filters are made for steps of a fast IMU, and hold what comes less often.
const MIN_IMU_HZ: f64 = 10.0;
const MIN_HZ: f64 = 2.0;
/// Share of a least rate that is still accepted: clocks differ.
const MIN_SHARE_OF_RATE: f64 = 0.99;
/// Largest share of samples with the stamp of the previous sample, and of these with another value.
const MAX_DUPLICATES: f64 = 0.05;
const MAX_CONTRADICTING: f64 = 0.001;
/// Longest time, s, and largest share of the log, for which a channel may have no samples while another one has.
const MAX_SILENT_S: f64 = 2.0;
const MAX_SILENT_SHARE: f64 = 0.01;
/// Least share of the samples that count.
const MIN_VALID: f64 = 0.5;
/// Time, s, and multiple of the longest other constant time, above which a value is frozen. A motor may be at its limit
/// for some time.
const FROZEN_S: f64 = 3.0;
const FROZEN_TORQUE_S: f64 = 10.0;
const FROZEN_TIMES: f64 = 5.0;
/// Largest share of samples at an end of the range.
const MAX_CLIPPED: f64 = 0.02;
/// Largest lag, s, least correlation that shows a lag, and least ratio of unexplained variance without the lag.
const MAX_LAG_S: f64 = 0.05;
const MIN_CORRELATION: f64 = 0.6;
const MIN_RATIO: f64 = 1.2;

/// All of them.
pub(super) fn all(series: &Series) -> Vec<Check> {
    let mut all: Vec<Check> = series.channels.iter().filter_map(rate).collect();
    let covered = series.channels.iter().map(|c| c.stamps.covered_ns);
    let log_s = covered.max().unwrap_or(0) as f64 * 1e-9;
    all.extend(series.channels.iter().filter_map(|c| silent(c, log_s)));
    all.extend(series.channels.iter().filter_map(|c| frozen(c, series)));
    all.extend(series.channels.iter().flat_map(clipped));
    let lags = [
        ("specific force", series.lags.force()),
        ("traction", series.lags.traction()),
    ];
    let lags = lags.into_iter().filter_map(|(name, l)| Some((name, l?)));
    all.extend(lags.map(|(name, lag)| lag_check(name, lag)));
    all
}

/// Name of a measured channel; `None` for a command.
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
    matches!(
        slot.measurand,
        Measurand::SpecificForce | Measurand::AngularRate
    )
}

fn is_used_for_motion(target: Target) -> bool {
    let wheel = |target| matches!(target, Target::Measured(slot) if slot.measurand == Measurand::WheelSpeed);
    is_imu(target) || wheel(target) || target.is_traction()
}

/// The figures of each channel that is measured.
pub(super) fn reports(series: &Series) -> Vec<ChannelReport> {
    let each = series.channels.iter();
    each.filter_map(|c| report(c, name(c.target)?)).collect()
}

fn report(c: &ChannelFigures, name: String) -> Option<ChannelReport> {
    let offered = c.stamps.offered as f64;
    (c.stamps.offered > 1).then_some(ChannelReport {
        name,
        rate_hz: c.rate.rate_hz,
        jitter_ms: c.rate.jitter_ms,
        gaps: c.rate.gaps,
        longest_gap_s: c.rate.longest_gap_s,
        duplicates: c.stamps.duplicates,
        valid: c.stamps.accepted as f64 / offered,
    })
}

/// The mistake in the rate, the stamps or the usable share; `None` without a mistake.
fn rate(c: &ChannelFigures) -> Option<Check> {
    let report = report(c, name(c.target)?)?;
    let least = match (is_imu(c.target), is_used_for_motion(c.target)) {
        (true, _) => MIN_IMU_HZ,
        (_, true) => MIN_HZ,
        _ => 0.0,
    };
    let name = report.name;
    if report.rate_hz < MIN_SHARE_OF_RATE * least {
        let why = "too slow for these estimators".into();
        let good = format!("{least} or more");
        let what = format!("{name}: rate");
        return Some(check(what, report.rate_hz, "Hz", &good, Verdict::Bad(why)));
    }
    let twice = report.duplicates as f64 / c.stamps.offered as f64;
    if twice > MAX_DUPLICATES {
        let why = "rows were written twice, or the clock is too coarse".into();
        let what = format!("{name}: share with the stamp of the previous sample");
        let good = format!("below {MAX_DUPLICATES}");
        return Some(check(what, twice, "", &good, Verdict::Bad(why)));
    }
    let offered = c.stamps.offered as f64;
    let contradicting = c.stamps.contradicting as f64 / offered;
    if contradicting > MAX_CONTRADICTING {
        let why = "two logs are in one file, or rows belong to another instrument: the right value is unknown";
        let what = format!("{name}: share with the stamp of the previous sample and another value");
        let good = format!("below {MAX_CONTRADICTING}");
        let verdict = Verdict::Bad(why.into());
        return Some(check(what, contradicting, "", &good, verdict));
    }
    (report.valid < MIN_VALID).then(|| {
        let why = "`valid_if` rejects the others, or their columns are empty".into();
        let what = format!("{name}: usable share of its samples");
        check(
            what,
            report.valid,
            "",
            &format!("{MIN_VALID} or more"),
            Verdict::Unknown(why),
        )
    })
}

/// The time for which a channel has no samples while another one has, if it is more than a little of the log (s).
fn silent(c: &ChannelFigures, log_s: f64) -> Option<Check> {
    let name = name(c.target).filter(|_| is_used_for_motion(c.target))?;
    let silent_s = log_s - c.stamps.covered_ns as f64 * 1e-9;
    (silent_s > MAX_SILENT_S && silent_s > MAX_SILENT_SHARE * log_s).then(|| {
        check(
            format!("{name}: time without samples while other channels have some"),
            silent_s,
            "s",
            &format!(
                "below {MAX_SILENT_S}, or {} % of the log",
                100.0 * MAX_SILENT_SHARE
            ),
            Verdict::Bad(
                "the channel has a gap, its file begins later or ends earlier, or its time has another unit".into(),
            ),
        )
    })
}

/// The share of the samples of each column at an end of its range, as the log has them: before they are turned.
fn clipped(c: &ChannelFigures) -> Vec<Check> {
    let Some(name) = name(c.target) else {
        return Vec::new();
    };
    // wheel speeds come in coarse steps and stay at one for long: an end of their range is none of the instrument
    let clips = is_imu(c.target) || c.target.is_traction();
    let ranges = c.stamps.ranges.iter().zip([" x", " y", " z"]);
    let of = |(range, axis): (&ColumnRange, &str)| {
        let value = range.at_an_end();
        let verdict = match range.is_constant() {
            _ if range.n <= 100 && clips => Verdict::Unknown(format!("only {} samples", range.n)),
            true if value == 0.0 => Verdict::Unknown(
                "it is always zero: the vehicle stands, or the channel is not connected".into(),
            ),
            true => Verdict::Bad(
                "it never changes: the channel is not connected, or the column is wrong".into(),
            ),
            false if value > MAX_CLIPPED && clips => {
                Verdict::Bad("it stays at an end of its range: clipped".into())
            }
            false => Verdict::Good,
        };
        let good = match clips {
            true => format!("below {MAX_CLIPPED}"),
            false => "not constant".to_owned(),
        };
        let axis = if is_imu(c.target) { axis } else { "" };
        check(
            format!("{name}{axis}: share at an end of its range"),
            value,
            "",
            &good,
            verdict,
        )
    };
    ranges.filter(|(range, _)| range.n > 0).map(of).collect()
}

/// A channel with a constant value while the vehicle moves; shown only if this happens.
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
    let windows: Vec<_> = series.balance.windows.iter().filter(within).collect();
    let moving = windows
        .iter()
        .filter(|w| w.speed.abs() > MOVING_MPS)
        .count();
    (2 * moving > windows.len()).then(|| {
        check(
            format!(
                "{name}: longest time with one value while the vehicle moves, from {from_s:.1} s"
            ),
            longest_s,
            "s",
            &format!("below {least_s}, or as others"),
            Verdict::Bad("it is frozen: its stamps change, but its value does not".into()),
        )
    })
}

fn lag_check(name: &str, lag: Lag) -> Check {
    let verdict = match lag {
        l if l.correlation < MIN_CORRELATION => Verdict::Unknown(format!(
            "it does not follow the acceleration of the wheels (correlation {:.2})",
            l.correlation
        )),
        l if l.lag_s.abs() > MAX_LAG_S && l.unexplained_ratio() > MIN_RATIO => {
            let late = if l.lag_s > 0.0 {
                "it comes"
            } else {
                "the wheels come"
            };
            Verdict::Bad(format!(
                "{late} {:.0} ms late: set `clocks: {{FILE: {{offset_s: …}}}}` of the late file; the lag makes a mass wrong",
                1e3 * l.lag_s.abs()
            ))
        }
        l if l.lag_s.abs() > MAX_LAG_S => Verdict::Unknown(
            "a lag of 0 explains the log nearly as well, so this lag is not certain".into(),
        ),
        _ => Verdict::Good,
    };
    let range = format!("-{MAX_LAG_S} to {MAX_LAG_S}");
    check(
        format!("lag of the {name} against the wheels"),
        lag.lag_s,
        "s",
        &range,
        verdict,
    )
}
