//! One run of a battery, as a line of JSON.

use crate::metrics::Quantity;
use crate::verdicts::run_result::RunResult;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Metrics of a quantity in the order of [`crate::stress::Figures`].
pub(crate) fn metrics(quantity: Quantity) -> [String; 7] {
    let [error, sd] = match quantity {
        Quantity::Mass => ["rmse_rel_valid", "sd_rel_mean_valid"],
        _ => ["rmse_deg_valid", "sd_mean_deg_valid"],
    };
    let marks = "availability misleading_share overconfident_share beyond_limit_share recovered_s";
    let mut all = [error, sd].into_iter().chain(marks.split(' '));
    std::array::from_fn(|_| format!("{}_{}", quantity.name(), all.next().unwrap_or_default()))
}

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
    /// Fingerprint of the inputs of the estimators.
    pub(crate) given: String,
    /// Metrics of every estimator; null = could not be measured.
    pub(crate) estimators: BTreeMap<String, BTreeMap<String, Option<f64>>>,
    /// Reason why the run broke down, if it did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

impl StressRun {
    /// Extracts the values for a matrix from a result.
    pub(crate) fn of(condition: &str, given: String, result: RunResult) -> Self {
        let unfinished = !result.finished() && result.error.is_none();
        let unfinished = unfinished.then(|| "the run did not finish".to_owned());
        let all = result.summary.into_iter().flat_map(|s| s.estimators);
        let wanted = Quantity::ALL.map(metrics).concat();
        let figures = |all: BTreeMap<String, Option<f64>>| {
            let all = all.into_iter();
            all.filter(|(name, _)| wanted.contains(name)).collect()
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

    /// A metric of an estimator; `None` if it could not be measured.
    pub(crate) fn figure(&self, estimator: &str, metric: &str) -> Option<f64> {
        *self.estimators.get(estimator)?.get(metric)?
    }

    /// Description for messages, such as `oil, whole_train seed 2`.
    pub fn words(&self) -> String {
        format!("{}, {} seed {}", self.condition, self.scenario, self.seed)
    }
}
