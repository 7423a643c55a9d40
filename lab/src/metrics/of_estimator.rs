//! Metrics of one estimator.

use crate::metrics::Metric;
use crate::metrics::series::ErrorSample;
use crate::metrics::statistics::{max, mean, percentile, rms, share, share_in_band};

/// Mass counts as converged when its error stays within this share.
const CONVERGED: f64 = 0.02;
/// Errors *after convergence* count from where the error has first stayed within that share for so long, s.
const SETTLED_S: f64 = 1.0;
const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// The metrics of one estimator.
pub const METRICS: &[Metric<ErrorSample>] = &[
    Metric {
        name: "mass_rmse_kg",
        unit: "kg",
        doc: "root mean square error of the total mass",
        value: |s| rms(mass(s).map(|x| x.mass_kg)),
    },
    Metric {
        name: "mass_mae_kg",
        unit: "kg",
        doc: "mean absolute error of the total mass",
        value: |s| mean(mass(s).map(|x| x.mass_kg.abs())),
    },
    Metric {
        name: "mass_error_max_kg",
        unit: "kg",
        doc: "largest error of the total mass",
        value: |s| max(mass(s).map(|x| x.mass_kg)),
    },
    Metric {
        name: "mass_error_rel_max",
        unit: "1",
        doc: "largest error of the total mass over the total mass",
        value: |s| max(mass(s).map(|x| x.mass_rel)),
    },
    Metric {
        name: "mass_error_rel_p95",
        unit: "1",
        doc: "95th percentile of the absolute error of the total mass over the total mass",
        value: |s| percentile(mass(s).map(|x| x.mass_rel.abs()), 0.95),
    },
    Metric {
        name: "mass_error_converged_max_kg",
        unit: "kg",
        doc: "largest error of the total mass after convergence: from where it has first stayed within 2 % for 1 s",
        value: |s| max(mass(settled(s)).map(|x| x.mass_kg)),
    },
    Metric {
        name: "mass_error_converged_rel_max",
        unit: "1",
        doc: "largest error of the total mass after convergence, over the total mass",
        value: |s| max(mass(settled(s)).map(|x| x.mass_rel)),
    },
    Metric {
        name: "mass_error_rel_end",
        unit: "1",
        doc: "error of the total mass over the total mass, mean of the last second, absolute",
        value: end,
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
        name: "mass_nees_in_band",
        unit: "1",
        doc: "share of samples with a NEES of the mass within the 95 % band of χ²₁ (below 3.84); 0.95 when consistent, more when cautious",
        value: |s| share_in_band(mass(s).map(|x| x.mass_nees)),
    },
    Metric {
        name: "mass_valid_share",
        unit: "1",
        doc: "share of samples for which the estimator vouches for the mass",
        value: |s| share(s.iter().map(|x| x.mass_valid)),
    },
    Metric {
        name: "slope_rmse_deg",
        unit: "°",
        doc: "root mean square error of the slope against the grade at the IMU",
        value: |s| rms(degrees(s)),
    },
    Metric {
        name: "slope_mae_deg",
        unit: "°",
        doc: "mean absolute error of the slope",
        value: |s| mean(degrees(s).map(f64::abs)),
    },
    Metric {
        name: "slope_error_max_deg",
        unit: "°",
        doc: "largest error of the slope",
        value: |s| max(degrees(s)),
    },
    Metric {
        name: "slope_error_p95_deg",
        unit: "°",
        doc: "95th percentile of the absolute error of the slope",
        value: |s| percentile(degrees(s).map(f64::abs), 0.95),
    },
    Metric {
        name: "slope_rmse_percent",
        unit: "%",
        doc: "root mean square error of the slope as roads state it, 100 tan θ",
        value: |s| rms(slope(s).map(|x| x.slope_percent)),
    },
    Metric {
        name: "slope_error_max_percent",
        unit: "%",
        doc: "largest error of the slope as roads state it",
        value: |s| max(slope(s).map(|x| x.slope_percent)),
    },
    Metric {
        name: "slope_effective_rmse_deg",
        unit: "°",
        doc: "root mean square error of the slope against the effective grade of the whole vehicle",
        value: |s| rms(slope(s).map(|x| x.slope_effective / DEGREE)),
    },
    Metric {
        name: "slope_nees_mean",
        unit: "1",
        doc: "mean of (error / standard deviation)² of the slope; 1 when consistent",
        value: |s| mean(slope(s).map(|x| x.slope_nees)),
    },
    Metric {
        name: "slope_nees_in_band",
        unit: "1",
        doc: "share of samples with a NEES of the slope within the 95 % band of χ²₁",
        value: |s| share_in_band(slope(s).map(|x| x.slope_nees)),
    },
    Metric {
        name: "slope_valid_share",
        unit: "1",
        doc: "share of samples for which the estimator vouches for the slope",
        value: |s| share(s.iter().map(|x| x.slope_valid)),
    },
    Metric {
        name: "running_resistance_rmse",
        unit: "1",
        doc: "root mean square error of the running-resistance coefficient, of estimators that identify it (internal `running_resistance`), also where they do not vouch for it",
        value: |s| rms(s.iter().map(|x| x.running_resistance)),
    },
    Metric {
        name: "nis_mean",
        unit: "1",
        doc: "mean normalised innovation squared; 1 when consistent",
        value: |s| mean(slope(s).map(|x| x.nis)),
    },
    Metric {
        name: "nis_in_band",
        unit: "1",
        doc: "share of samples with a NIS within the 95 % band of χ²₁; 0.95 when consistent",
        value: |s| share_in_band(slope(s).map(|x| x.nis)),
    },
];

fn mass(s: &[ErrorSample]) -> impl Iterator<Item = &ErrorSample> {
    s.iter().filter(|x| x.mass_valid)
}

fn slope(s: &[ErrorSample]) -> impl Iterator<Item = &ErrorSample> {
    s.iter().filter(|x| x.slope_valid)
}

fn degrees(s: &[ErrorSample]) -> impl Iterator<Item = f64> {
    slope(s).map(|x| x.slope / DEGREE)
}

fn close(x: &ErrorSample) -> bool {
    x.mass_valid && x.mass_rel.abs() <= CONVERGED
}

/// The samples after convergence.
fn settled(s: &[ErrorSample]) -> &[ErrorSample] {
    let mut since = None;
    for (i, x) in s.iter().enumerate() {
        match since {
            _ if !close(x) => since = None,
            None => since = Some(x.t_s),
            Some(t_s) if x.t_s - t_s >= SETTLED_S - 1e-9 => return &s[i..],
            Some(_) => {}
        }
    }
    &[]
}

fn end(s: &[ErrorSample]) -> f64 {
    let Some(last) = s.last() else {
        return f64::NAN;
    };
    let late = mass(s).filter(|x| x.t_s > last.t_s - 1.0);
    mean(late.map(|x| x.mass_rel)).abs()
}

fn convergence(s: &[ErrorSample]) -> f64 {
    let from = s.iter().rposition(|x| !close(x)).map_or(0, |i| i + 1);
    s.get(from).map_or(f64::NAN, |x| x.t_s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::measure;
    use crate::metrics::series::ErrorSeries;

    fn series(errors: &[(f64, bool)]) -> ErrorSeries {
        let sample = |(i, &(e, valid)): (usize, &(f64, bool))| ErrorSample {
            t_s: i as f64,
            mass_rel: e,
            mass_kg: 1000.0 * e,
            mass_valid: valid,
            mass_nees: 100.0 * e * e,
            slope: e * DEGREE,
            slope_percent: 2.0 * e,
            slope_valid: valid,
            running_resistance: f64::NAN,
            ..Default::default()
        };
        ErrorSeries {
            estimators: vec![("x".into(), errors.iter().enumerate().map(sample).collect())],
            ..Default::default()
        }
    }

    #[test]
    fn an_estimator_that_never_vouches_has_no_error_not_a_zero_one() {
        let s = series(&[(0.0, false), (0.0, false)]);
        for m in METRICS {
            let x = measure(&s, "x", m.name, 0.0, 9.0).unwrap();
            match m.name.ends_with("_valid_share") {
                true => assert_eq!(x, 0.0, "{}", m.name),
                false => assert!(x.is_nan(), "{}: {x}", m.name),
            }
        }
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
        let rmse = ((0.09 + 0.16 + 2e-4) / 4.0f64).sqrt();
        close("slope_rmse_deg", 1.0, rmse);
        close("slope_rmse_percent", 1.0, 2.0 * rmse);
        close("slope_error_max_deg", 1.0, 0.4);
        close("slope_error_max_percent", 1.0, 0.8);
        close("slope_mae_deg", 1.0, 0.18);
        close("mass_mae_kg", 1.0, 180.0);
        close("mass_error_max_kg", 1.0, 400.0);
        close("mass_error_rel_max", 1.0, 0.4);
        close("mass_error_rel_p95", 1.0, 0.4);
        close("mass_convergence_s", 0.0, 3.0);
        close("mass_rmse_kg", 3.0, 10.0);
        close("mass_nees_mean", 3.0, 0.01);
        close("mass_nees_in_band", 1.0, 0.5);
    }

    /// What comes after convergence counts, also where it is worse than the 2 % that convergence means.
    #[test]
    fn after_convergence_means_from_the_first_second_within_two_percent_on() {
        let s = series(&[
            (0.01, true),
            (0.5, true),
            (0.01, false),
            (0.01, true),
            (0.015, true),
            (0.03, true),
            (0.001, true),
        ]);
        let of = |m: &str| measure(&s, "x", m, 0.0, 9.0).unwrap();
        assert_eq!(of("mass_error_converged_rel_max"), 0.03);
        assert_eq!(of("mass_error_converged_max_kg"), 30.0);
        assert_eq!(of("mass_convergence_s"), 6.0);
        let never = series(&[(0.01, true), (0.5, true), (0.01, true)]);
        assert!(
            measure(&never, "x", "mass_error_converged_rel_max", 0.0, 9.0)
                .unwrap()
                .is_nan()
        );
    }
}
