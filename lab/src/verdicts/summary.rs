//! `metrics.json`: the numbers of one run, and whether what its scenario expects held. The same run gives the same
//! bytes.

use crate::verdicts::common::CommonErrors;
use crate::verdicts::integrity::Integrity;
use monorig_sim::config::scenario::IntegrityLimits;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Start of the metrics, unless an expectation has its own, s: the transient at the start does not count.
pub const AFTER_S: f64 = 5.0;
/// The metrics shown first.
pub(crate) const MAIN: &[&str] = &[
    "mass_error_rel_max",
    "mass_error_rel_max_valid",
    "mass_availability",
    "slope_rmse_deg",
    "slope_rmse_deg_valid",
    "slope_availability",
    "effective_slope_rmse_deg",
    "effective_slope_rmse_deg_valid",
    "effective_slope_availability",
];

/// The numbers of one run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Summary {
    /// Format version, 1.
    pub version: u32,
    /// Scenario name.
    pub scenario: String,
    /// Seed.
    pub seed: u64,
    /// True if the end of the scenario was reached.
    pub finished: bool,
    /// Estimators without a single valid sample in the whole run.
    pub never_valid: Vec<String>,
    /// Simulated time, s.
    pub simulated_s: f64,
    /// Steps of the plant.
    pub steps: u64,
    /// Metrics are taken from here on, s.
    pub after_s: f64,
    /// Per estimator: its metrics; null = could not be measured.
    pub estimators: BTreeMap<String, BTreeMap<String, Option<f64>>>,
    /// Metrics of train and controller.
    pub run: BTreeMap<String, Option<f64>>,
    /// Steps refused by an estimator: name, how many, first reason.
    pub refusals: Vec<(String, u64, String)>,
    /// Expectations of the scenario, and those that follow from them.
    pub expectations: Vec<ExpectationVerdict>,
    /// When a valid sample is misleading.
    #[serde(default)]
    pub limits: IntegrityLimits,
    /// Integrity of every estimator and quantity.
    #[serde(default)]
    pub integrity: Vec<Integrity>,
    /// Errors of estimators and of the reference of a comparison, over the samples that both mark valid. Empty
    /// elsewhere.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub common: BTreeMap<String, CommonErrors>,
}

/// One expectation, judged.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ExpectationVerdict {
    /// Estimator, if it is about one.
    pub estimator: Option<String>,
    /// Metric.
    pub metric: String,
    /// The time it is measured over, in words, such as ` from 5 s`; empty for the whole run.
    pub window: String,
    /// Measured from here, s; none = from the start.
    pub after_s: Option<f64>,
    /// Measured to here, s; none = to the end.
    pub until_s: Option<f64>,
    /// Upper bound.
    pub at_most: Option<f64>,
    /// Lower bound.
    pub at_least: Option<f64>,
    /// Share of the seeds that must hold it; none = all.
    pub quantile: Option<f64>,
    /// Measured value; null = could not be measured, which is a failure.
    pub value: Option<f64>,
    /// True if it held. A run that did not finish holds nothing.
    pub held: bool,
    /// Why it is known not to hold, if it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub known_failure: Option<String>,
}

impl ExpectationVerdict {
    /// The measured value, such as `dffrls_aekf_robust mass_error_rel_max from 10 s`.
    pub fn what(&self) -> String {
        match &self.estimator {
            Some(name) => format!("{name} {}{}", self.metric, self.window),
            None => format!("{}{}", self.metric, self.window),
        }
    }

    /// True if it held, or if it failed and is known to fail.
    pub(crate) fn good(&self) -> bool {
        self.held || self.known_failure.is_some()
    }

    /// The bound in words, such as `≤ 0.032`.
    pub fn bound(&self) -> String {
        let most = self.at_most.map(|m| format!("≤ {m}"));
        let least = self.at_least.map(|l| format!("≥ {l}"));
        most.into_iter()
            .chain(least)
            .collect::<Vec<_>>()
            .join(" and ")
    }

    /// Distance of the value beyond its bound, as a share of the bound's size; infinite when it could not be measured.
    pub(crate) fn excess(&self) -> f64 {
        let Some(value) = self.value else {
            return f64::INFINITY;
        };
        let over = self
            .at_most
            .map(|m| (value - m) / m.abs().max(f64::MIN_POSITIVE));
        let under = self
            .at_least
            .map(|l| (l - value) / l.abs().max(f64::MIN_POSITIVE));
        over.into_iter()
            .chain(under)
            .fold(f64::NEG_INFINITY, f64::max)
    }
}

impl Summary {
    /// True for a good run: it finished, every bound held or is known not to, and no judged estimator in it is
    /// misleading.
    pub fn good(&self) -> bool {
        let judged = |i: &&Integrity| i.at_most.is_some() && i.known_failure.is_none();
        let within = |i: &Integrity| i.valid == 0 || Some(i.share()) <= i.at_most;
        self.finished
            && self.expectations.iter().all(ExpectationVerdict::good)
            && self.integrity.iter().filter(judged).all(within)
    }

    /// As it stands in the file.
    pub fn to_json(&self) -> String {
        // Strings and finite numbers: nothing in here can fail to serialise.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }
}
