//! The quantities that an estimator marks valid or not, each by itself.

use crate::metrics::of_estimator::DEGREE;
use crate::metrics::series::ErrorSample;
use monorig_sim::config::scenario::IntegrityLimits;
use serde::{Deserialize, Serialize};

/// A quantity that an estimator estimates, with a validity of its own.
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
    /// All of them.
    pub(crate) const ALL: [Self; 3] = [Self::Mass, Self::Slope, Self::EffectiveSlope];

    /// As names of metrics begin.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Mass => "mass",
            Self::Slope => "slope",
            Self::EffectiveSlope => "effective_slope",
        }
    }

    /// In a sentence.
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

    /// True where the estimator marks it valid.
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

    /// True for a misleading sample: marked valid, and its error exceeds both k standard deviations and the alert
    /// limit.
    pub(crate) fn is_misleading(self, x: &ErrorSample, limits: &IntegrityLimits) -> bool {
        self.is_valid(x)
            && self.nees(x) > limits.k * limits.k
            && self.error(x).abs() > self.alert(limits)
    }
}
