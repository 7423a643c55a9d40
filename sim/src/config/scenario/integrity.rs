//! Alert limits of a scenario, beyond which a valid estimate misleads.

use crate::config::checked::{Fraction, Positive};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Limits of integrity. A sample marked valid is misleading when its error exceeds both `k` reported standard
/// deviations (the protection level) and the alert limit of its quantity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Integrity {
    /// Protection level over reported standard deviation; a level that an estimator reports counts k/3 times.
    pub(crate) k: Positive,
    /// Alert limit of the slope, °.
    pub slope_alert_deg: Positive,
    /// Alert limit of the effective slope, °; none = the limit of the slope.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub effective_slope_alert_deg: Option<Positive>,
    /// Alert limit of the mass, as a share of the mass.
    pub(crate) mass_alert_rel: Positive,
    /// Largest share of misleading samples among the valid samples of an estimator, over all seeds.
    pub(crate) max_misleading_share: Fraction,
    /// Estimators that are shown for reference and not judged by these limits, in addition to published methods without
    /// supervision.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub reference_only: Vec<String>,
}

/// Protection level over standard deviation where the scenario says nothing.
const DEFAULT_K: f64 = 3.0;

impl Default for Integrity {
    fn default() -> Self {
        Self {
            k: Positive::new(DEFAULT_K),
            // an application that trims traction by slope and mass
            slope_alert_deg: Positive::new(0.25),
            effective_slope_alert_deg: None,
            mass_alert_rel: Positive::new(0.03),
            max_misleading_share: Fraction::new(0.001),
            reference_only: Vec::new(),
        }
    }
}

/// Limits of a scenario, with defaults for missing values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct IntegrityLimits {
    /// Protection level over reported standard deviation.
    pub k: f64,
    /// Alert limit of the mass, as a share of the mass.
    pub mass_rel: f64,
    /// Alert limit of the slope, °.
    pub slope_deg: f64,
    /// Alert limit of the effective slope, °.
    pub effective_slope_deg: f64,
    /// Largest share of misleading samples among the valid samples, over all seeds.
    pub max_share: f64,
}

impl From<&Integrity> for IntegrityLimits {
    fn from(own: &Integrity) -> Self {
        let slope_deg = own.slope_alert_deg.get();
        let effective = own.effective_slope_alert_deg;
        Self {
            k: own.k.get(),
            mass_rel: own.mass_alert_rel.get(),
            slope_deg,
            effective_slope_deg: effective.map_or(slope_deg, Positive::get),
            max_share: own.max_misleading_share.get(),
        }
    }
}

impl IntegrityLimits {
    /// Returns the factor on protection levels that estimators report: k over its default.
    pub fn of_reported(&self) -> f64 {
        self.k / DEFAULT_K
    }
}

impl Default for IntegrityLimits {
    fn default() -> Self {
        Self::from(&Integrity::default())
    }
}
