//! Quality of an estimator's marks of validity: availability, integrity, overconfidence, continuity, recovery; and the
//! share of samples that a reference tells anything of.
//!
//! Terms after the navigation of aircraft (RTCA DO-229; Stanford diagram: Tossaint et al. 2007).

use crate::metrics::Quantity;
use crate::metrics::of_estimator::CONVERGED;
use crate::metrics::series::ErrorSample;
use crate::metrics::statistics::{Accumulator, Mean, Running};
use monorig_sim::config::scenario::IntegrityLimits;

const HOUR_S: f64 = 3600.0;

/// Quality of an estimator's marks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Marks {
    /// Share of samples marked valid.
    Availability,
    /// Share of the valid samples that is misleading.
    Integrity,
    /// Share of the valid samples beyond the protection level, for any size of the error.
    Overconfidence,
    /// Share of the valid samples beyond the alert limit, for any standard deviation.
    BeyondLimit,
    /// Time from which on every valid value is right until the end.
    Convergence,
    /// Time of the first valid value after which no value misleads.
    Recovery,
    /// Losses of validity per hour.
    Continuity,
    /// Share of samples that have a reference, with any marks.
    Referenced,
}

/// A figure of the quality of marks.
pub(super) fn start(
    kind: Marks,
    quantity: Quantity,
    limits: &IntegrityLimits,
) -> Running<ErrorSample> {
    let share_of = |of_judged, is| -> Running<ErrorSample> {
        Box::new(MarkShare {
            quantity,
            limits: *limits,
            of_judged,
            is,
            share: Mean::default(),
        })
    };
    let (share, wrong) = (|is| share_of(false, is), |is| share_of(true, is));
    let right_since = |is_right| -> Running<ErrorSample> {
        Box::new(RightSince {
            quantity,
            limits: *limits,
            is_right,
            since_s: f64::NAN,
        })
    };
    match kind {
        Marks::Availability => share(|q, x, limits| q.is_available(x, limits.k)),
        Marks::Integrity => wrong(|q, x, limits| q.is_misleading(x, limits)),
        Marks::Overconfidence => wrong(|q, x, limits| q.is_overconfident(x, limits)),
        Marks::BeyondLimit => wrong(|q, x, limits| q.error(x).abs() > q.alert(limits)),
        // the mass at the start is no estimate
        Marks::Convergence => {
            right_since(|q, x, _| x.mass_estimated && q.error(x).abs() <= CONVERGED)
        }
        Marks::Recovery => right_since(|q, x, limits| !q.is_misleading(x, limits)),
        Marks::Continuity => Box::new(Losses::new(quantity)),
        Marks::Referenced => share(|q, x, _| q.has_reference(x)),
    }
}

/// Share of the samples, or of the samples that can be judged, for which a condition is true.
struct MarkShare {
    quantity: Quantity,
    limits: IntegrityLimits,
    of_judged: bool,
    is: fn(Quantity, &ErrorSample, &IntegrityLimits) -> bool,
    share: Mean,
}

impl Accumulator<ErrorSample> for MarkShare {
    fn add(&mut self, x: &ErrorSample) {
        // without a reference nobody knows whether a sample is wrong
        if !self.of_judged || self.quantity.is_judged(x) {
            self.share
                .add_bool((self.is)(self.quantity, x, &self.limits));
        }
    }

    fn value(&self) -> f64 {
        self.share.value()
    }
}

/// Time of the first valid value from which on every valid value fulfils a condition. NaN where the last one is not.
struct RightSince {
    quantity: Quantity,
    limits: IntegrityLimits,
    is_right: fn(Quantity, &ErrorSample, &IntegrityLimits) -> bool,
    since_s: f64,
}

impl Accumulator<ErrorSample> for RightSince {
    fn add(&mut self, x: &ErrorSample) {
        if !self.quantity.is_judged(x) {
            return;
        }
        self.since_s = match (self.is_right)(self.quantity, x, &self.limits) {
            false => f64::NAN,
            true if self.since_s.is_nan() => x.t_s,
            true => self.since_s,
        };
    }

    fn value(&self) -> f64 {
        self.since_s
    }
}

/// Rate of losses of validity: valid samples followed by an invalid one, over the time of all samples. NaN where
/// nothing was ever valid.
struct Losses {
    quantity: Quantity,
    times_s: Option<(f64, f64)>,
    valid: bool,
    ever_valid: bool,
    losses: u64,
}

impl Losses {
    fn new(quantity: Quantity) -> Self {
        Self {
            quantity,
            times_s: None,
            valid: false,
            ever_valid: false,
            losses: 0,
        }
    }
}

impl Accumulator<ErrorSample> for Losses {
    fn add(&mut self, x: &ErrorSample) {
        let valid = self.quantity.is_valid(x);
        self.losses += u64::from(self.valid && !valid);
        self.ever_valid |= valid;
        self.valid = valid;
        let (first_s, _) = self.times_s.unwrap_or((x.t_s, x.t_s));
        self.times_s = Some((first_s, x.t_s));
    }

    fn value(&self) -> f64 {
        match self.times_s {
            Some((first_s, last_s)) if self.ever_valid => {
                self.losses as f64 * HOUR_S / (last_s - first_s)
            }
            _ => f64::NAN,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::of_estimator::DEGREE;
    use crate::metrics::{METRICS, Of};

    /// Ten samples in 9 s; mass, slope and effective slope alike: error in alert limits, standard deviation in alert
    /// limits, valid.
    fn series(of: &[(f64, f64, bool)]) -> Vec<ErrorSample> {
        let limits = IntegrityLimits::default();
        let sample = |(i, &(error, sd, valid)): (usize, &(f64, f64, bool))| ErrorSample {
            t_s: i as f64,
            mass_rel: error * limits.mass_rel,
            mass_nees: (error / sd).powi(2),
            mass_valid: valid,
            mass_estimated: true,
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
            let mut marks = m.of_estimator(&IntegrityLimits::default()).unwrap();
            s.iter().for_each(|x| marks.add(x));
            let x = marks.value();
            let is = match kind {
                Marks::Availability => 0.7,
                Marks::Integrity => 2.0 / 7.0,
                Marks::Overconfidence => 3.0 / 7.0,
                Marks::BeyondLimit => 3.0 / 7.0,
                Marks::Convergence => 6.0,
                Marks::Recovery => 6.0,
                Marks::Continuity => 2.0 * 3600.0 / 9.0,
                Marks::Referenced => 1.0,
            };
            assert!((x - is).abs() < 1e-12, "{}: {x} against {is}", m.name);
        }
    }

    /// Two of seven valid samples mislead. Without a reference of three others there are two of four, not two of seven.
    #[test]
    fn a_sample_without_a_reference_is_neither_misleading_nor_right() {
        let mut s = series(&[(2.0, 0.1, true); 7]);
        for (i, x) in s.iter_mut().enumerate() {
            let none = i >= 4;
            (x.unreferenced, x.mass_rel) = ([none; 3], if none { f64::NAN } else { x.mass_rel });
            if (2..4).contains(&i) {
                (x.mass_rel, x.mass_nees) = (0.0, 0.0);
            }
        }
        let of = |kind| {
            let mut marks = start(kind, Quantity::Mass, &IntegrityLimits::default());
            s.iter().for_each(|x| marks.add(x));
            marks.value()
        };
        assert_eq!(of(Marks::Integrity), 0.5);
        assert_eq!(of(Marks::Referenced), 4.0 / 7.0);
        assert_eq!(of(Marks::Availability), 1.0);
    }

    #[test]
    fn of_what_is_never_valid_there_is_neither_integrity_nor_continuity() {
        let s = series(&[(9.0, 0.1, false), (9.0, 0.1, false)]);
        let of = |kind| {
            let mut marks = start(kind, Quantity::Mass, &IntegrityLimits::default());
            s.iter().for_each(|x| marks.add(x));
            marks.value()
        };
        assert_eq!(of(Marks::Availability), 0.0);
        assert!(of(Marks::Integrity).is_nan() && of(Marks::Continuity).is_nan());
        assert!(of(Marks::Overconfidence).is_nan() && of(Marks::Recovery).is_nan());
    }

    /// The protection level holds for an error of any size: 0.5 % of mass with a standard deviation of 0.1 % is
    /// overconfident and does not mislead; without a standard deviation every valid sample is overconfident.
    #[test]
    fn overconfidence_knows_no_alert_limit() {
        let of = |kind, sd: f64| {
            let x = ErrorSample {
                mass_rel: 0.005,
                mass_nees: (0.005 / sd).powi(2),
                mass_valid: true,
                ..Default::default()
            };
            let mut marks = start(kind, Quantity::Mass, &IntegrityLimits::default());
            marks.add(&x);
            marks.value()
        };
        for (sd, share) in [(0.001, 1.0), (0.01, 0.0), (f64::NAN, 1.0), (0.0, 1.0)] {
            assert_eq!(of(Marks::Overconfidence, sd), share, "{sd}");
            assert_eq!(of(Marks::Integrity, sd), 0.0, "{sd}");
        }
    }

    /// The reference's variance is in the normalised square: an error of 4 with a standard deviation of 1 is beyond
    /// three; with 1 of the reference beside it it is not (4/√2 = 2.8).
    #[test]
    fn the_variance_of_the_reference_excuses() {
        let of = |nees| {
            let x = ErrorSample {
                slope_nees: nees,
                slope: 4.0 * DEGREE,
                slope_valid: true,
                ..Default::default()
            };
            Quantity::Slope.is_overconfident(&x, &IntegrityLimits::default())
        };
        assert!(of(16.0) && !of(8.0));
    }
}
