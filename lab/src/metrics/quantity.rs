//! The quantities that an estimator marks valid or not, independently.

use crate::metrics::of_estimator::DEGREE;
use crate::metrics::series::ErrorSample;
use monorig_sim::config::scenario::IntegrityLimits;
use serde::{Deserialize, Serialize};

/// A quantity that an estimator estimates, with its own validity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Quantity {
    /// Total mass.
    Mass,
    /// Slope at the IMU.
    Slope,
    /// Effective slope of the whole vehicle.
    EffectiveSlope,
}

impl Quantity {
    /// All quantities.
    pub(crate) const ALL: [Self; 3] = [Self::Mass, Self::Slope, Self::EffectiveSlope];

    /// Beginning of the names of metrics.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Mass => "mass",
            Self::Slope => "slope",
            Self::EffectiveSlope => "effective_slope",
        }
    }

    /// Name in a sentence.
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Mass => "mass",
            Self::Slope => "slope",
            Self::EffectiveSlope => "effective slope",
        }
    }

    /// The column of recordings, `estimates/NAME/…`.
    pub(crate) fn channel(self) -> &'static str {
        match self {
            Self::Mass => "total_mass",
            Self::Slope => "grade",
            Self::EffectiveSlope => "effective_grade",
        }
    }

    /// The column of the truth.
    pub(crate) fn truth_channel(self) -> &'static str {
        match self {
            Self::Mass => "truth/total_mass",
            Self::Slope => "truth/grade_at_imu",
            Self::EffectiveSlope => "truth/grade_effective",
        }
    }

    /// The unit of its errors in reports, and the factor to it.
    pub(crate) fn unit(self) -> (&'static str, f64) {
        match self {
            Self::Mass => ("%", 100.0),
            Self::Slope | Self::EffectiveSlope => ("°", 1.0),
        }
    }

    /// Beginning of a title.
    pub(crate) fn title(self) -> &'static str {
        match self {
            Self::Mass => "Mass",
            Self::Slope => "Slope",
            Self::EffectiveSlope => "Effective slope",
        }
    }

    /// True where the estimator marks the quantity valid.
    pub(crate) fn is_valid(self, x: &ErrorSample) -> bool {
        match self {
            Self::Mass => x.mass_valid,
            Self::Slope => x.slope_valid,
            Self::EffectiveSlope => x.effective_valid,
        }
    }

    /// True where it has a reference: of a simulation always, of a recorded drive where the map's reference is known.
    pub(crate) fn has_reference(self, x: &ErrorSample) -> bool {
        let [mass, slope, effective] = x.unreferenced;
        !match self {
            Self::Mass => mass,
            Self::Slope => slope,
            Self::EffectiveSlope => effective,
        }
    }

    /// Its error: the mass's as a share of the mass, slopes in degrees.
    pub(crate) fn error(self, x: &ErrorSample) -> f64 {
        match self {
            Self::Mass => x.mass_rel,
            Self::Slope => x.slope / DEGREE,
            Self::EffectiveSlope => x.slope_effective / DEGREE,
        }
    }

    /// (error / reported standard deviation)².
    pub(crate) fn nees(self, x: &ErrorSample) -> f64 {
        match self {
            Self::Mass => x.mass_nees,
            Self::Slope => x.slope_nees,
            Self::EffectiveSlope => x.effective_nees,
        }
    }

    /// Its alert limit, in the unit of [`Quantity::error`].
    pub(crate) fn alert(self, limits: &IntegrityLimits) -> f64 {
        match self {
            Self::Mass => limits.mass_rel,
            Self::Slope => limits.slope_deg,
            Self::EffectiveSlope => limits.effective_slope_deg,
        }
    }

    /// Largest protection level that an estimate is credited with, in the unit of [`Quantity::error`]: the largest
    /// error within three standard deviations that the validity rule of the supervised estimators lets pass as valid.
    /// It lets pass 3°, and 10 % of the estimate: an estimate M of a mass m with M - m = 3 · 0.1 M has an error of
    /// 0.3/0.7 of m. A larger protection level says nothing about the value.
    pub(crate) fn max_protection(self) -> f64 {
        match self {
            Self::Mass => 0.3 / 0.7,
            Self::Slope | Self::EffectiveSlope => 9.0,
        }
    }

    /// Its reported standard deviation, in the unit of [`Quantity::error`].
    fn sd(self, x: &ErrorSample) -> f64 {
        match self {
            Self::Mass => x.mass_sd_rel,
            Self::Slope => x.slope_sd / DEGREE,
            Self::EffectiveSlope => x.effective_sd / DEGREE,
        }
    }

    /// True for a sample that can be used: marked valid, with k standard deviations that are credited. Without a
    /// reference of the mass its standard deviation as a share of the mass is not known.
    pub(crate) fn is_available(self, x: &ErrorSample, k: f64) -> bool {
        let told = k * self.sd(x) <= self.max_protection();
        self.is_valid(x) && (told || self == Self::Mass && !self.has_reference(x))
    }

    /// True for a valid sample that can be judged: there is a reference.
    pub(crate) fn is_judged(self, x: &ErrorSample) -> bool {
        self.is_valid(x) && self.has_reference(x) && self.error(x).is_finite()
    }

    /// Standard deviation of the reference, in the unit of [`Quantity::error`].
    fn reference_sd(self, x: &ErrorSample) -> f64 {
        let [mass, slope] = x.reference_sd;
        if self == Self::Mass { mass } else { slope }
    }

    /// True where k standard deviations of the reference exceed the alert limit: such a reference can show that an
    /// estimate is wrong, and not that it is right.
    pub(crate) fn is_coarse(self, x: &ErrorSample, limits: &IntegrityLimits) -> bool {
        let sd = self.reference_sd(x);
        sd.is_nan() || limits.k * sd > self.alert(limits)
    }

    /// True for an overconfident sample: marked valid, and its error exceeds the protection level of the estimator or,
    /// if it has none, k standard deviations (with that of the reference), for any size; also without a standard
    /// deviation.
    pub(crate) fn is_overconfident(self, x: &ErrorSample, limits: &IntegrityLimits) -> bool {
        let level = x.protection[self as usize] * limits.of_reported();
        let (nees, k) = (self.nees(x), limits.k);
        let beyond = || match level > 0.0 {
            true => self.error(x).abs() > level.hypot(k * self.reference_sd(x)),
            false => nees.is_nan() || nees > k * k,
        };
        self.is_judged(x) && beyond()
    }

    /// True for a misleading sample: marked valid, and its error exceeds both the protection level, at most
    /// [`Quantity::max_protection`], and the alert limit; there is no protection without a standard deviation.
    pub(crate) fn is_misleading(self, x: &ErrorSample, limits: &IntegrityLimits) -> bool {
        let error = self.error(x).abs();
        let unprotected = || self.is_overconfident(x, limits) || error > self.max_protection();
        error > self.alert(limits) && self.is_judged(x) && unprotected()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use monorig_testing::Random;
    use monorig_testing::mutants;

    /// Whatever standard deviation is reported, a valid sample whose error is beyond any protection is misleading; one
    /// within the alert limit, without a reference, or not marked valid is not; and one in between is by its own.
    #[test]
    fn no_standard_deviation_excuses_any_error() {
        let mut random = Random::new(mutants::first_seed());
        let sds = [f64::NAN, f64::INFINITY, 1e9, 1e3, 1.0, 0.1, 1e-3, 0.0];
        for _ in 0..mutants::count(2000) {
            let limits = IntegrityLimits {
                k: 1.0 + 9.0 * random.unit(),
                ..IntegrityLimits::default()
            };
            let quantity = *random.of(&Quantity::ALL);
            let of_limit = *random.of(&[0.0, 0.5, 1.5, 4.0, 8.9, 9.1, 50.0, 1e6, f64::NAN]);
            let (alert, most) = (quantity.alert(&limits), quantity.max_protection());
            let error = of_limit * alert;
            let sd = *random.of(&sds) * alert;
            let nees = (error / sd).powi(2);
            let valid = random.below(4) > 0;
            let x = ErrorSample {
                mass_rel: error,
                slope: error * DEGREE,
                slope_effective: error * DEGREE,
                mass_nees: nees,
                slope_nees: nees,
                effective_nees: nees,
                mass_valid: valid,
                slope_valid: valid,
                effective_valid: valid,
                ..Default::default()
            };
            let is = quantity.is_misleading(&x, &limits);
            let told = format!(
                "{quantity:?}: error {error}, sd {sd}, k {}, valid {valid}",
                limits.k
            );
            if !valid || error.is_nan() || error <= alert {
                assert!(!is, "{told}");
            } else if error > most * 1.001 || sd.is_nan() {
                assert!(is, "{told}");
            } else {
                assert_eq!(is, error > limits.k * sd, "{told}");
            }
        }
    }

    /// A reported protection level decides in place of k standard deviations, with those of the reference, up to the
    /// largest that is credited.
    #[test]
    fn a_reported_level_takes_the_place_of_standard_deviations() {
        let limits = IntegrityLimits::default();
        for quantity in Quantity::ALL {
            let (alert, most) = (quantity.alert(&limits), quantity.max_protection());
            let is = |error: f64, level: f64, reference_sd: f64| {
                let x = ErrorSample {
                    protection: [level; 3],
                    reference_sd: [reference_sd; 2],
                    mass_rel: error,
                    slope: error * DEGREE,
                    slope_effective: error * DEGREE,
                    mass_valid: true,
                    slope_valid: true,
                    effective_valid: true,
                    ..Default::default()
                };
                quantity.is_misleading(&x, &limits)
            };
            assert!(is(2.01 * alert, 2.0 * alert, 0.0));
            assert!(!is(1.99 * alert, 2.0 * alert, 0.0));
            assert!(!is(0.99 * alert, 0.5 * alert, 0.0));
            let together = alert.hypot(3.0 * alert);
            assert!(is(1.01 * together, alert, alert) && !is(0.99 * together, alert, alert));
            assert!(is(1.01 * most, 2.0 * most, 0.0));
        }
    }

    /// A reference is fine up to where its own k standard deviations reach the alert limit, and an estimate is of use
    /// up to where its k standard deviations are credited: both ways, of each quantity.
    #[test]
    fn coarse_references_and_estimates_have_limits() {
        let mut random = Random::new(mutants::first_seed());
        for _ in 0..mutants::count(500) {
            let limits = IntegrityLimits::default();
            let quantity = *random.of(&Quantity::ALL);
            let (alert, most) = (quantity.alert(&limits), quantity.max_protection());
            let of_limit = *random.of(&[0.0, 0.5, 0.99, 1.01, 2.0, 1e3, f64::INFINITY, f64::NAN]);
            let coarse = of_limit.is_nan() || of_limit > 1.0;
            let sd = of_limit * alert / limits.k;
            let told = of_limit * most / limits.k;
            let x = ErrorSample {
                reference_sd: [sd, sd],
                mass_sd_rel: told,
                slope_sd: told * DEGREE,
                effective_sd: told * DEGREE,
                mass_valid: true,
                slope_valid: true,
                effective_valid: true,
                ..Default::default()
            };
            assert_eq!(quantity.is_coarse(&x, &limits), coarse, "{quantity:?} {sd}");
            assert_eq!(
                quantity.is_available(&x, limits.k),
                !coarse,
                "{quantity:?} {told}"
            );
        }
    }
}
