//! Published figures for a set-up, shown beside our figures, and never a bound by themselves.

use crate::config::checked::Finite;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A published figure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Published {
    /// Source with its place, such as `Liu et al. 2023, table 1`.
    pub source: String,
    /// Estimator that the figure belongs to.
    pub estimator: String,
    /// Metric that the figure belongs to.
    pub metric: String,
    /// The figure, in the metric's unit.
    pub value: Finite,
}
