//! Numbers that say how good a run was.
//!
//! Errors are estimate minus truth; the slope's truth is the grade at the IMU. Only samples for which the estimator vouches
//! count, and `*_valid_share` says how many those were: a metric without a single valid sample is not a number, never zero.

use crate::series::{Sample, Series};

/// A metric: name, unit and definition.
pub struct Metric {
    /// Name, as in `expect`.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// What it is.
    pub doc: &'static str,
    value: fn(&[Sample]) -> f64,
}

/// Mass counts as converged when its error stays within this share.
const CONVERGED: f64 = 0.02;
const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// The metrics of one estimator.
pub const METRICS: &[Metric] = &[
    Metric {
        name: "mass_rmse_kg",
        unit: "kg",
        doc: "root mean square error of the total mass",
        value: |s| rms(mass(s).map(|x| x.mass_kg)),
    },
    Metric {
        name: "mass_error_rel_max",
        unit: "1",
        doc: "largest error of the total mass over the total mass",
        value: |s| max(mass(s).map(|x| x.mass_rel)),
    },
    Metric {
        name: "mass_error_rel_end",
        unit: "1",
        doc: "error of the total mass over the total mass, mean of the last second, absolute",
        value: |s| end(s),
    },
    Metric {
        name: "mass_convergence_s",
        unit: "s",
        doc: "time from which the mass error stays within 2 % to the end",
        value: convergence,
    },
    Metric {
        name: "mass_nees_mean",
        unit: "1",
        doc: "mean of (error / standard deviation)² of the mass; 1 when consistent",
        value: |s| mean(mass(s).map(|x| x.mass_nees)),
    },
    Metric {
        name: "mass_valid_share",
        unit: "1",
        doc: "share of samples for which the estimator vouches for the mass",
        value: |s| share(s, |x| x.mass_valid),
    },
    Metric {
        name: "slope_rmse_deg",
        unit: "°",
        doc: "root mean square error of the slope against the grade at the IMU",
        value: |s| rms(slope(s).map(|x| x.slope / DEGREE)),
    },
    Metric {
        name: "slope_mae_deg",
        unit: "°",
        doc: "mean absolute error of the slope",
        value: |s| mean(slope(s).map(|x| (x.slope / DEGREE).abs())),
    },
    Metric {
        name: "slope_error_max_deg",
        unit: "°",
        doc: "largest error of the slope",
        value: |s| max(slope(s).map(|x| x.slope / DEGREE)),
    },
    Metric {
        name: "slope_error_p95_deg",
        unit: "°",
        doc: "95th percentile of the absolute error of the slope",
        value: |s| percentile(slope(s).map(|x| (x.slope / DEGREE).abs()), 0.95),
    },
    Metric {
        name: "slope_effective_rmse_deg",
        unit: "°",
        doc: "root mean square error of the slope against the effective grade of the whole train",
        value: |s| rms(slope(s).map(|x| x.slope_effective / DEGREE)),
    },
    Metric {
        name: "slope_nees_mean",
        unit: "1",
        doc: "mean of (error / standard deviation)² of the slope; 1 when consistent",
        value: |s| mean(slope(s).map(|x| x.slope_nees)),
    },
    Metric {
        name: "slope_valid_share",
        unit: "1",
        doc: "share of samples for which the estimator vouches for the slope",
        value: |s| share(s, |x| x.slope_valid),
    },
    Metric {
        name: "nis_mean",
        unit: "1",
        doc: "mean normalised innovation squared; 1 when consistent",
        value: |s| mean(slope(s).map(|x| x.nis)),
    },
];

fn mass(s: &[Sample]) -> impl Iterator<Item = &Sample> {
    s.iter().filter(|x| x.mass_valid)
}

fn slope(s: &[Sample]) -> impl Iterator<Item = &Sample> {
    s.iter().filter(|x| x.slope_valid)
}

fn mean(x: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for x in x {
        sum += x;
        n += 1.0;
    }
    if n > 0.0 { sum / n } else { f64::NAN }
}

fn rms(x: impl Iterator<Item = f64>) -> f64 {
    mean(x.map(|x| x * x)).sqrt()
}

fn max(x: impl Iterator<Item = f64>) -> f64 {
    x.map(f64::abs).fold(f64::NAN, f64::max)
}

fn share(s: &[Sample], yes: fn(&Sample) -> bool) -> f64 {
    mean(s.iter().map(|x| if yes(x) { 1.0 } else { 0.0 }))
}

fn percentile(x: impl Iterator<Item = f64>, p: f64) -> f64 {
    let mut x: Vec<f64> = x.collect();
    if x.is_empty() {
        return f64::NAN;
    }
    x.sort_unstable_by(f64::total_cmp);
    x[((x.len() - 1) as f64 * p).round() as usize]
}

fn end(s: &[Sample]) -> f64 {
    let Some(last) = s.last() else {
        return f64::NAN;
    };
    mean(
        mass(s)
            .filter(|x| x.t_s > last.t_s - 1.0)
            .map(|x| x.mass_rel),
    )
    .abs()
}

fn convergence(s: &[Sample]) -> f64 {
    let outside = s
        .iter()
        .rposition(|x| !x.mass_valid || x.mass_rel.abs() > CONVERGED);
    match outside {
        None => s.first().map_or(f64::NAN, |x| x.t_s),
        Some(i) => s.get(i + 1).map_or(f64::NAN, |x| x.t_s),
    }
}

/// A metric of one estimator over the time from `after_s` to `until_s`; none if there is no such metric or estimator.
pub fn measure(
    series: &Series,
    estimator: &str,
    metric: &str,
    after_s: f64,
    until_s: f64,
) -> Option<f64> {
    let (_, samples) = series
        .estimators
        .iter()
        .find(|(name, _)| name == estimator)?;
    measure_samples(samples, metric, after_s, until_s)
}

/// The same of samples at hand.
pub fn measure_samples(
    samples: &[Sample],
    metric: &str,
    after_s: f64,
    until_s: f64,
) -> Option<f64> {
    let metric = METRICS.iter().find(|m| m.name == metric)?;
    let from = samples.partition_point(|x| x.t_s < after_s);
    let to = samples.partition_point(|x| x.t_s <= until_s);
    Some((metric.value)(samples.get(from..to).unwrap_or(&[])))
}

/// Metrics of the train and the controller.
pub const RUN_METRICS: &[(&str, &str, &str)] = &[
    (
        "speed_rmse_mps",
        "m/s",
        "root mean square of speed minus reference",
    ),
    (
        "accel_rms_mps2",
        "m/s²",
        "root mean square acceleration along the rail: comfort",
    ),
    (
        "off_rail_max_m",
        "m",
        "largest distance of a wheel from its place on the rail",
    ),
];

/// A metric of the train or the controller over the time from `after_s` to `until_s`; none if there is no such metric.
pub fn measure_run(series: &Series, metric: &str, after_s: f64, until_s: f64) -> Option<f64> {
    let window = series
        .tracking
        .iter()
        .filter(|x| x.t_s >= after_s && x.t_s <= until_s);
    match metric {
        "speed_rmse_mps" => Some(rms(window.map(|x| x.speed))),
        "accel_rms_mps2" => Some(rms(window.map(|x| x.accel))),
        "off_rail_max_m" => Some(max(window.map(|x| x.off_rail))),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(errors: &[(f64, bool)]) -> Series {
        let samples = errors
            .iter()
            .enumerate()
            .map(|(i, &(e, valid))| Sample {
                t_s: i as f64,
                mass_rel: e,
                mass_kg: 1000.0 * e,
                mass_valid: valid,
                slope: e * DEGREE,
                slope_valid: valid,
                ..Default::default()
            })
            .collect();
        Series {
            estimators: vec![("x".into(), samples)],
            tracking: vec![],
        }
    }

    #[test]
    fn an_estimator_that_never_vouches_has_no_error_not_a_zero_one() {
        let s = series(&[(0.0, false), (0.0, false)]);
        for m in [
            "mass_rmse_kg",
            "slope_rmse_deg",
            "mass_error_rel_max",
            "mass_convergence_s",
        ] {
            assert!(measure(&s, "x", m, 0.0, 9.0).unwrap().is_nan(), "{m}");
        }
        assert_eq!(measure(&s, "x", "mass_valid_share", 0.0, 9.0), Some(0.0));
    }

    #[test]
    fn metrics_are_what_their_names_say() {
        let s = series(&[
            (9.0, true),
            (0.3, true),
            (-0.4, true),
            (0.01, true),
            (-0.01, true),
        ]);
        let close = |m: &str, from: f64, x: f64| {
            let y = measure(&s, "x", m, from, 9.0).unwrap();
            assert!((y - x).abs() < 1e-12, "{m}: {y} against {x}");
        };
        close(
            "slope_rmse_deg",
            1.0,
            ((0.09 + 0.16 + 2e-4) / 4.0f64).sqrt(),
        );
        close("slope_error_max_deg", 1.0, 0.4);
        close("slope_mae_deg", 1.0, 0.18);
        close("mass_error_rel_max", 1.0, 0.4);
        close("mass_convergence_s", 0.0, 3.0);
        close("mass_rmse_kg", 3.0, 10.0);
    }
}
