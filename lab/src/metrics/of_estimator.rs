//! What the metrics of one estimator are computed from: samples selected and scaled.

use crate::metrics::series::ErrorSample;
use crate::metrics::statistics::mean;

/// Mass counts as converged when its error stays within this share.
const CONVERGED: f64 = 0.02;
/// Errors *after convergence* count from where the error has first stayed within that share for so long, s.
const SETTLED_S: f64 = 1.0;
/// rad.
pub(super) const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// Samples whose mass is marked valid.
pub(super) fn mass(s: &[ErrorSample]) -> impl Iterator<Item = &ErrorSample> {
    s.iter().filter(|x| x.mass_valid)
}

/// Samples whose slope is marked valid.
pub(super) fn slope(s: &[ErrorSample]) -> impl Iterator<Item = &ErrorSample> {
    s.iter().filter(|x| x.slope_valid)
}

/// Slope errors of the valid samples, °.
pub(super) fn degrees(s: &[ErrorSample]) -> impl Iterator<Item = f64> {
    slope(s).map(|x| x.slope / DEGREE)
}

fn close(x: &ErrorSample) -> bool {
    x.mass_valid && x.mass_rel.abs() <= CONVERGED
}

/// The samples after convergence.
pub(super) fn settled(s: &[ErrorSample]) -> &[ErrorSample] {
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

/// Mean relative mass error of the last second, absolute.
pub(super) fn end(s: &[ErrorSample]) -> f64 {
    let Some(last) = s.last() else {
        return f64::NAN;
    };
    let late = mass(s).filter(|x| x.t_s > last.t_s - 1.0);
    mean(late.map(|x| x.mass_rel)).abs()
}

/// Time from which the mass stays converged to the end, s.
pub(super) fn convergence(s: &[ErrorSample]) -> f64 {
    let from = s.iter().rposition(|x| !close(x)).map_or(0, |i| i + 1);
    s.get(from).map_or(f64::NAN, |x| x.t_s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::series::ErrorSeries;
    use crate::metrics::{estimator_metrics, measure};

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
    fn without_a_valid_sample_there_is_no_error_not_a_zero_one() {
        let s = series(&[(0.0, false), (0.0, false)]);
        for m in estimator_metrics() {
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
