//! What an estimator's marks of validity are worth: availability, integrity, continuity.
//!
//! Terms after the navigation of aircraft (RTCA DO-229; Stanford diagram: Tossaint et al. 2007).

use crate::metrics::series::ErrorSample;
use crate::metrics::statistics::share;
use crate::metrics::{Marks, Quantity};
use monorig_sim::config::scenario::IntegrityLimits;

const HOUR_S: f64 = 3600.0;

/// One of the three over these samples.
pub(super) fn value(
    kind: Marks,
    quantity: Quantity,
    samples: &[ErrorSample],
    limits: &IntegrityLimits,
) -> f64 {
    match kind {
        Marks::Availability => share(samples.iter().map(|x| quantity.is_valid(x))),
        Marks::Integrity => {
            let valid = samples.iter().filter(|x| quantity.is_valid(x));
            share(valid.map(|x| quantity.is_misleading(x, limits)))
        }
        Marks::Continuity => losses_per_h(samples, quantity),
    }
}

/// How often a valid sample is followed by one that is not, over the time of all samples; not a number where nothing was ever valid.
fn losses_per_h(samples: &[ErrorSample], quantity: Quantity) -> f64 {
    if !samples.iter().any(|x| quantity.is_valid(x)) {
        return f64::NAN;
    }
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else {
        return f64::NAN;
    };
    losses(samples, quantity) as f64 * HOUR_S / (last.t_s - first.t_s)
}

/// How often a valid sample is followed by one that is not.
pub(super) fn losses(samples: &[ErrorSample], quantity: Quantity) -> usize {
    let lost = |w: &&[ErrorSample]| match w {
        [a, b] => quantity.is_valid(a) && !quantity.is_valid(b),
        _ => false,
    };
    samples.windows(2).filter(lost).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::of_estimator::DEGREE;
    use crate::metrics::{METRICS, Of};

    /// Ten samples in 9 s; mass, slope and effective slope alike: error in alert limits, standard deviation in alert limits, valid.
    fn series(of: &[(f64, f64, bool)]) -> Vec<ErrorSample> {
        let limits = IntegrityLimits::default();
        let sample = |(i, &(error, sd, valid)): (usize, &(f64, f64, bool))| ErrorSample {
            t_s: i as f64,
            mass_rel: error * limits.mass_rel,
            mass_nees: (error / sd).powi(2),
            mass_valid: valid,
            slope: error * limits.slope_deg * DEGREE,
            slope_nees: (error / sd).powi(2),
            slope_valid: valid,
            slope_effective: error * limits.effective_slope_deg * DEGREE,
            effective_nees: (error / sd).powi(2),
            effective_valid: valid,
            ..Default::default()
        };
        of.iter().enumerate().map(sample).collect()
    }

    #[test]
    fn marks_are_worth_what_they_are() {
        let s = series(&[
            (0.5, 0.1, true),  // beyond 3 sd, but not beyond the alert limit: not misleading
            (2.0, 1.0, true),  // beyond the alert limit, but within 3 sd
            (2.0, 0.1, true),  // misleading
            (-2.0, 0.1, true), // misleading
            (9.0, 0.1, false), // not marked valid, a first loss
            (9.0, 0.1, false),
            (0.1, 0.1, true),
            (9.0, 0.1, false), // a second loss
            (0.1, 0.1, true),
            (-0.1, 0.1, true),
        ]);
        for m in METRICS {
            let Of::Marks { kind, .. } = m.of else {
                continue;
            };
            let x = m.over(&s, &IntegrityLimits::default()).unwrap();
            let is = match kind {
                Marks::Availability => 0.7,
                Marks::Integrity => 2.0 / 7.0,
                Marks::Continuity => 2.0 * 3600.0 / 9.0,
            };
            assert!((x - is).abs() < 1e-12, "{}: {x} against {is}", m.name);
        }
    }

    #[test]
    fn of_what_is_never_valid_there_is_neither_integrity_nor_continuity() {
        let s = series(&[(9.0, 0.1, false), (9.0, 0.1, false)]);
        let of = |kind| value(kind, Quantity::Mass, &s, &IntegrityLimits::default());
        assert_eq!(of(Marks::Availability), 0.0);
        assert!(of(Marks::Integrity).is_nan() && of(Marks::Continuity).is_nan());
    }
}
