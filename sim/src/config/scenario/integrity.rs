//! When an estimate marked valid is misleading: alert limits of a scenario.

use super::{Published, ScenarioFile};
use crate::config::checked::{Fraction, Positive};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Limits of integrity. A sample marked valid is misleading when its error exceeds both `k` reported standard
/// deviations (the protection level) and the alert limit of its quantity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Integrity {
    /// Protection level over reported standard deviation.
    pub(crate) k: Positive,
    /// Alert limit of the slope, °; none = 3 times the least slope RMSE in `published`, 1° if there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slope_alert_deg: Option<Positive>,
    /// Alert limit of the effective slope, °; none = that of the slope.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub effective_slope_alert_deg: Option<Positive>,
    /// Alert limit of the mass, as a share of it.
    pub(crate) mass_alert_rel: Positive,
    /// Most that may be misleading of the samples that an estimator marks valid, over all seeds.
    pub(crate) max_misleading_share: Fraction,
    /// Estimators that are shown beside the others and not judged by this; besides them published methods without
    /// supervision.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub reference_only: Vec<String>,
}

/// Alert limit of the slope where nothing is published, °: three times the 0.328° of a real vehicle (Liu et al. 2023,
/// table 4).
const SLOPE_ALERT_DEG: f64 = 1.0;
/// A published RMSE becomes an alert limit by this factor.
const OVER_PUBLISHED: f64 = 3.0;

impl Default for Integrity {
    fn default() -> Self {
        Self {
            k: Positive::new(3.0),
            slope_alert_deg: None,
            effective_slope_alert_deg: None,
            mass_alert_rel: Positive::new(0.1), // three times the 3.2 % of Liu et al. 2023
            max_misleading_share: Fraction::new(0.001),
            reference_only: Vec::new(),
        }
    }
}

/// The limits of a scenario, with published figures in the place of what it leaves open.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct IntegrityLimits {
    /// Protection level over reported standard deviation.
    pub k: f64,
    /// Alert limit of the mass, as a share of it.
    pub mass_rel: f64,
    /// Alert limit of the slope, °.
    pub slope_deg: f64,
    /// Alert limit of the effective slope, °.
    pub effective_slope_deg: f64,
    /// Most that may be misleading of the valid samples, over all seeds.
    pub max_share: f64,
}

impl IntegrityLimits {
    /// Of a scenario.
    pub fn of(file: &ScenarioFile) -> Self {
        let own = &file.integrity;
        let published = file.published.iter().filter_map(slope_rmse_deg);
        let least = published.reduce(f64::min);
        let slope_deg = match (own.slope_alert_deg, least) {
            (Some(limit), _) => limit.get(),
            (None, Some(least)) => OVER_PUBLISHED * least,
            (None, None) => SLOPE_ALERT_DEG,
        };
        Self {
            k: own.k.get(),
            mass_rel: own.mass_alert_rel.get(),
            slope_deg,
            effective_slope_deg: own
                .effective_slope_alert_deg
                .map_or(slope_deg, Positive::get),
            max_share: own.max_misleading_share.get(),
        }
    }
}

impl Default for IntegrityLimits {
    fn default() -> Self {
        let own = Integrity::default();
        Self {
            k: own.k.get(),
            mass_rel: own.mass_alert_rel.get(),
            slope_deg: SLOPE_ALERT_DEG,
            effective_slope_deg: SLOPE_ALERT_DEG,
            max_share: own.max_misleading_share.get(),
        }
    }
}

/// A published root mean square error of the slope, °.
pub(super) fn slope_rmse_deg(p: &Published) -> Option<f64> {
    match p.metric.as_str() {
        "slope_rmse_deg" => Some(p.value.get()),
        "slope_rmse_percent" => Some((p.value.get() / 100.0).atan().to_degrees()),
        _ => None,
    }
}
