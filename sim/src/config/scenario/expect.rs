//! Bounds a scenario promises to hold; measured by `monorig-lab`.

use crate::config::checked::{Finite, Fraction, NonNegative, Positive};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A bound on a metric: `metric`, over the time from `after_s` to `until_s`, is `at_most` and/or `at_least` so much.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Expectation {
    /// The estimator judged; none for metrics of the train or the controller.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub estimator: Option<String>,
    /// Name of the metric, such as `mass_error_rel_max`.
    pub metric: String,
    /// Measured from here, s; none = from the start.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub after_s: Option<NonNegative>,
    /// Measured to here, s; none = to the end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until_s: Option<Positive>,
    /// Upper bound, in the metric's unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_most: Option<Finite>,
    /// Lower bound, in the metric's unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_least: Option<Finite>,
    /// Over several seeds: the share of runs that must hold the bound (0.5 = the median run); none = every run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quantile: Option<Fraction>,
}
