//! Errors of one estimator that need more than a sum over samples.

use crate::metrics::series::ErrorSample;
use crate::metrics::statistics::{Accumulator, Mean, Running};
use std::collections::VecDeque;

/// Share within which the error of the mass must stay to count as converged.
pub(super) const CONVERGED: f64 = 0.02;
/// Time for which the error must first stay within this share; errors *after convergence* count from its begin, s.
const SETTLED_S: f64 = 1.0;
/// rad.
pub(super) const DEGREE: f64 = std::f64::consts::PI / 180.0;

fn close(x: &ErrorSample) -> bool {
    x.mass_valid && x.mass_estimated && x.mass_rel.abs() <= CONVERGED
}

/// Largest magnitude after convergence.
pub(super) fn converged_max(of: impl Fn(&ErrorSample) -> f64 + 'static) -> Running<ErrorSample> {
    Box::new(ConvergedMax {
        of,
        close_since_s: None,
        settled: false,
        most: f64::NAN,
    })
}

struct ConvergedMax<F> {
    of: F,
    close_since_s: Option<f64>,
    settled: bool,
    most: f64,
}

impl<F: Fn(&ErrorSample) -> f64> Accumulator<ErrorSample> for ConvergedMax<F> {
    fn add(&mut self, x: &ErrorSample) {
        match self.close_since_s {
            _ if self.settled => {}
            _ if !close(x) => self.close_since_s = None,
            None => self.close_since_s = Some(x.t_s),
            Some(t_s) => self.settled = x.t_s - t_s >= SETTLED_S - 1e-9,
        }
        if self.settled {
            self.most = self.most.max((self.of)(x).abs());
        }
    }

    fn value(&self) -> f64 {
        self.most
    }
}

/// Mean relative mass error of the last second, absolute.
pub(super) fn end() -> Running<ErrorSample> {
    Box::new(LastStretch(VecDeque::new()))
}

/// Times and errors of the last second.
struct LastStretch(VecDeque<(f64, f64)>);

impl Accumulator<ErrorSample> for LastStretch {
    fn add(&mut self, x: &ErrorSample) {
        self.0.push_back((x.t_s, x.mass_rel));
        while self.0.front().is_some_and(|(t_s, _)| *t_s <= x.t_s - 1.0) {
            self.0.pop_front();
        }
    }

    fn value(&self) -> f64 {
        let mut mean = Mean::default();
        self.0.iter().for_each(|(_, error)| mean.add(*error));
        mean.value().abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::series::ErrorSeries;
    use crate::metrics::{Marks, Of, estimator_metrics, measure};

    fn sample(t_s: f64, e: f64, valid: bool) -> ErrorSample {
        ErrorSample {
            protection: [f64::NAN; 3],
            reference_sd: [0.0; 2],
            t_s,
            unreferenced: [false; 3],
            mass_rel: e,
            mass_kg: 1000.0 * e,
            mass_valid: valid,
            mass_estimated: true,
            mass_sd_rel: 0.1,
            mass_sd_kg: 100.0,
            slope_sd: 0.05 * DEGREE,
            effective_sd: 0.1 * DEGREE,
            mass_nees: 100.0 * e * e,
            slope: e * DEGREE,
            slope_percent: 2.0 * e,
            slope_nees: 400.0 * e * e,
            slope_valid: valid,
            slope_effective: 3.0 * e * DEGREE,
            effective_nees: 900.0 * e * e,
            effective_valid: valid,
            lagged: e * DEGREE,
            lagged_nees: 400.0 * e * e,
            nis: 16.0 * e * e,
            running_resistance: f64::NAN,
            answers: None,
            mass_bound: 0.1,
            slope_bound: 0.1 * DEGREE,
            effective_bound: 0.1 * DEGREE,
        }
    }

    fn series(errors: &[(f64, bool)]) -> ErrorSeries {
        let samples = errors.iter().enumerate();
        let samples = samples.map(|(i, &(e, valid))| sample(i as f64, e, valid));
        ErrorSeries {
            estimators: vec![("x".into(), samples.collect())],
            ..Default::default()
        }
    }

    #[test]
    fn without_a_sample_that_counts_there_is_no_error_not_a_zero_one() {
        let s = series(&[(0.0, false), (0.0, false)]);
        for m in estimator_metrics() {
            let x = measure(&s, "x", m.name, 0.0, 9.0).unwrap();
            let nothing = measure(&s, "x", m.name, 5.0, 9.0).unwrap();
            assert!(nothing.is_nan(), "{}: {nothing}", m.name);
            let begins_valid = ["_over_bound", "_converged_", "_protection_"]
                .iter()
                .any(|part| m.name.contains(part));
            match m.of {
                Of::Marks {
                    kind: Marks::Availability,
                    ..
                } => assert_eq!(x, 0.0, "{}", m.name),
                Of::Marks {
                    kind: Marks::Referenced,
                    ..
                } => assert_eq!(x, 1.0, "{}", m.name),
                Of::Error {
                    valid_only: false, ..
                } if !begins_valid => assert!(x.is_finite(), "{}: {x}", m.name),
                _ => assert!(x.is_nan(), "{}: {x}", m.name),
            }
        }
    }

    /// A closed form for each: errors 0.3, −0.4, 0.01, −0.01 on all samples.
    #[test]
    fn metrics_are_what_their_names_say() {
        let s = series(&[
            (9.0, true),
            (0.3, true),
            (-0.4, false),
            (0.01, true),
            (-0.01, true),
        ]);
        let close = |m: &str, from: f64, x: f64| {
            let y = measure(&s, "x", m, from, 9.0).unwrap();
            assert!((y - x).abs() < 1e-12, "{m}: {y} against {x}");
        };
        let all = ((0.09 + 0.16 + 2e-4) / 4.0f64).sqrt();
        let valid = ((0.09 + 2e-4) / 3.0f64).sqrt();
        for (name, factor) in [
            ("mass_rmse_kg", 1000.0),
            ("slope_rmse_deg", 1.0),
            ("slope_rmse_percent", 2.0),
            ("effective_slope_rmse_deg", 3.0),
        ] {
            close(name, 1.0, factor * all);
            close(&format!("{name}_valid"), 1.0, factor * valid);
        }
        for (name, factor) in [
            ("mass_error_max_kg", 1000.0),
            ("mass_error_rel_max", 1.0),
            ("mass_error_rel_p95", 1.0),
            ("slope_error_max_deg", 1.0),
            ("slope_error_p95_deg", 1.0),
            ("slope_error_max_percent", 2.0),
            ("effective_slope_error_max_deg", 3.0),
            ("effective_slope_error_p95_deg", 3.0),
        ] {
            close(name, 1.0, factor * 0.4);
            close(&format!("{name}_valid"), 1.0, factor * 0.3);
        }
        for (name, factor) in [
            ("mass_mae_kg", 1000.0),
            ("slope_mae_deg", 1.0),
            ("effective_slope_mae_deg", 3.0),
        ] {
            close(name, 1.0, factor * 0.18);
            close(&format!("{name}_valid"), 1.0, factor * 0.32 / 3.0);
        }
        for (name, factor) in [
            ("mass_nees_mean", 100.0),
            ("slope_nees_mean", 400.0),
            ("effective_slope_nees_mean", 900.0),
            ("nis_mean", 16.0),
        ] {
            close(name, 1.0, factor * 0.2502 / 4.0);
            close(&format!("{name}_valid"), 1.0, factor * 0.0902 / 3.0);
        }
        for (name, factor) in [
            ("mass_bias", 1.0),
            ("slope_bias_deg", 1.0),
            ("effective_slope_bias_deg", 3.0),
        ] {
            close(name, 1.0, factor * -0.1 / 4.0);
            close(&format!("{name}_valid"), 1.0, factor * 0.3 / 3.0);
        }
        for (name, factor) in [
            ("mass_scatter_rel", 1.0),
            ("slope_scatter_deg", 1.0),
            ("effective_slope_scatter_deg", 3.0),
        ] {
            close(name, 1.0, factor * (0.2502 / 4.0f64 - 0.025 * 0.025).sqrt());
            close(
                &format!("{name}_valid"),
                1.0,
                factor * (0.0902 / 3.0f64 - 0.01).sqrt(),
            );
        }
        // within the band: |e| below 0.196, 0.098, 0.065; of the innovation 0.49
        for name in [
            "mass_nees_in_band",
            "slope_nees_in_band",
            "effective_slope_nees_in_band",
        ] {
            close(name, 1.0, 0.5);
            close(&format!("{name}_valid"), 1.0, 2.0 / 3.0);
        }
        close("nis_in_band", 0.0, 0.8);
        close("nis_in_band_valid", 0.0, 0.75);
        close("mass_convergence_s", 0.0, 3.0);
        close("mass_error_rel_end", 0.0, 0.01);
    }

    /// Samples without a reference change no error: those of the others are what they are without them, and the share
    /// that has a reference is told.
    #[test]
    fn errors_are_over_the_samples_that_have_a_reference() {
        let of = |s: &ErrorSeries, m: &str| measure(s, "x", m, 0.0, 99.0).unwrap();
        let errors = [(0.3, true), (-0.4, false), (0.01, true), (-0.01, true)];
        let known = series(&errors);
        let mut partly = series(&errors);
        for i in 0..4 {
            let unknown = ErrorSample {
                t_s: f64::from(i) + 0.5,
                unreferenced: [true; 3],
                nis: 16.0 * f64::from(i),
                mass_valid: true,
                slope_valid: true,
                effective_valid: true,
                ..sample(0.0, f64::NAN, true)
            };
            partly.estimators[0].1.insert(2 * i as usize + 1, unknown);
        }
        for m in estimator_metrics() {
            if let Of::Error {
                referenced: true, ..
            } = m.of
            {
                let (a, b) = (of(&known, m.name), of(&partly, m.name));
                // the time of convergence is one of the samples that count
                assert!(a == b || (a.is_nan() && b.is_nan()), "{}: {a} {b}", m.name);
            }
        }
        assert_eq!(of(&partly, "slope_reference_share"), 0.5);
        assert_eq!(of(&partly, "slope_availability"), 7.0 / 8.0);
        assert!(of(&partly, "nis_mean") > of(&known, "nis_mean"));
    }

    /// An estimator that marks only its good samples valid has no better errors for it, but for those that begin with
    /// its first valid sample.
    #[test]
    fn marking_only_the_good_samples_valid_changes_no_error() {
        let errors = [0.5, 0.01, -0.3, 0.02, 0.001];
        let honest = series(&errors.map(|e| (e, true)));
        let choosy = series(&errors.map(|e| (e, e.abs() < 0.05)));
        for m in estimator_metrics() {
            let of = |s| measure(s, "x", m.name, 0.0, 9.0).unwrap();
            let begins_valid = m.name.contains("_over_bound") || m.name.contains("_converged_");
            match m.of {
                Of::Error {
                    valid_only: false, ..
                } if !begins_valid => {
                    assert_eq!(of(&honest).to_bits(), of(&choosy).to_bits(), "{}", m.name)
                }
                Of::Marks {
                    kind: Marks::Availability,
                    ..
                } => assert!(of(&choosy) < of(&honest)),
                _ => {}
            }
        }
    }

    /// Neither the value at the start nor one that is not marked valid has converged.
    #[test]
    fn the_first_guess_and_what_is_not_valid_have_not_converged() {
        let mut s = series(&[(0.0, true), (0.01, false), (0.5, false), (0.01, true)]);
        s.estimators[0].1[0].mass_estimated = false;
        let of = |m: &str| measure(&s, "x", m, 0.0, 9.0).unwrap();
        assert_eq!(of("mass_convergence_s"), 3.0);
        assert!(of("mass_error_converged_rel_max").is_nan());
    }

    /// The error over its bound counts from the first valid sample on, the invalid ones after it too.
    #[test]
    fn over_the_bound_counts_from_the_first_valid_sample() {
        let s = series(&[(9.0, false), (0.1, true), (0.3, false)]);
        let x = measure(&s, "x", "mass_rmse_over_bound", 0.0, 9.0).unwrap();
        assert!((x - (0.05f64).sqrt() / 0.1).abs() < 1e-12, "{x}");
    }

    /// Samples after convergence count, also where they are worse than the 2 % that convergence means.
    #[test]
    fn after_convergence_means_from_the_first_second_within_two_percent_on() {
        let s = series(&[
            (0.01, true),
            (0.5, true),
            (0.03, false),
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
