//! One run of a battery, as a line of JSON.

use crate::verdicts::run_result::RunResult;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Metrics of each quantity in the order of [`crate::stress::Figures`].
pub(crate) const FIGURES: [[&str; 6]; 3] = [
    [
        "mass_rmse_rel_valid",
        "mass_sd_rel_mean_valid",
        "mass_availability",
        "mass_misleading_share",
        "mass_overconfident_share",
        "mass_recovered_s",
    ],
    [
        "slope_rmse_deg_valid",
        "slope_sd_mean_deg_valid",
        "slope_availability",
        "slope_misleading_share",
        "slope_overconfident_share",
        "slope_recovered_s",
    ],
    [
        "effective_slope_rmse_deg_valid",
        "effective_slope_sd_mean_deg_valid",
        "effective_slope_availability",
        "effective_slope_misleading_share",
        "effective_slope_overconfident_share",
        "effective_slope_recovered_s",
    ],
];

/// Outcome of a run of a battery.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StressRun {
    /// Place in the battery, from 0.
    pub(crate) index: u64,
    /// Condition.
    pub(crate) condition: String,
    /// Scenario.
    pub(crate) scenario: String,
    /// Seed.
    pub(crate) seed: u64,
    /// Fingerprint of what the estimators were given.
    pub(crate) given: String,
    /// Metrics of every estimator; null = could not be measured.
    pub(crate) estimators: BTreeMap<String, BTreeMap<String, Option<f64>>>,
    /// Why the run broke down, if it did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

impl StressRun {
    /// Takes from a result what a matrix needs.
    pub(crate) fn of(condition: &str, given: String, result: RunResult) -> Self {
        let unfinished = !result.finished() && result.error.is_none();
        let unfinished = unfinished.then(|| "it did not come to its end".to_owned());
        let all = result.summary.into_iter().flat_map(|s| s.estimators);
        let figures = |all: BTreeMap<String, Option<f64>>| {
            let wanted = |name: &String| FIGURES.iter().flatten().any(|f| f == name);
            all.into_iter().filter(|(name, _)| wanted(name)).collect()
        };
        Self {
            index: result.index,
            condition: condition.to_owned(),
            scenario: result.scenario,
            seed: result.seed,
            given,
            estimators: all.map(|(name, values)| (name, figures(values))).collect(),
            error: result.error.or(unfinished),
        }
    }

    /// A metric of an estimator; none where it could not be measured.
    pub(crate) fn figure(&self, estimator: &str, metric: &str) -> Option<f64> {
        *self.estimators.get(estimator)?.get(metric)?
    }

    /// Description for messages, such as `oil, whole_train seed 2`.
    pub fn words(&self) -> String {
        format!("{}, {} seed {}", self.condition, self.scenario, self.seed)
    }
}
