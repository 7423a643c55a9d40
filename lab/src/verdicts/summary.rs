//! `metrics.json`: the numbers of one run, and whether what its scenario expects held. The same run gives the same
//! bytes.

use crate::verdicts::common::CommonErrors;
use crate::verdicts::integrity::{Integrity, Outcome};
use monorig_sim::config::scenario::IntegrityLimits;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Default start of the metrics, s: the transient at the start does not count.
pub const AFTER_S: f64 = 5.0;
/// The metrics shown first.
pub(crate) const MAIN: &[&str] = &[
    "mass_error_rel_max",
    "mass_error_rel_max_valid",
    "mass_availability",
    "mass_beyond_limit_share",
    "slope_rmse_deg",
    "slope_rmse_deg_valid",
    "slope_availability",
    "slope_beyond_limit_share",
    "effective_slope_rmse_deg",
    "effective_slope_rmse_deg_valid",
    "effective_slope_availability",
    "effective_slope_beyond_limit_share",
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
    /// Start of the metrics, s.
    pub after_s: f64,
    /// Per estimator: its metrics; null = could not be measured.
    pub estimators: BTreeMap<String, BTreeMap<String, Option<f64>>>,
    /// Metrics of train and controller.
    pub run: BTreeMap<String, Option<f64>>,
    /// Steps refused by an estimator: name, how many, first reason.
    pub refusals: Vec<(String, u64, String)>,
    /// Expectations of the scenario, and expectations that follow from these.
    pub expectations: Vec<ExpectationVerdict>,
    /// Limits beyond which a valid sample is misleading.
    #[serde(default)]
    pub limits: IntegrityLimits,
    /// Integrity of every estimator and quantity.
    #[serde(default)]
    pub integrity: Vec<Integrity>,
    /// Limits of the scenario that are weaker than usual, in words.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub weakened: Vec<String>,
    /// Errors of estimators and of the reference of a comparison, over the samples that both mark valid. Empty
    /// elsewhere.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub common: BTreeMap<String, CommonErrors>,
}

/// One expectation, judged.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ExpectationVerdict {
    /// Estimator, if the expectation is for an estimator.
    pub estimator: Option<String>,
    /// Metric.
    pub metric: String,
    /// Window of the measurement in words, such as ` from 5 s`; empty for the whole run.
    pub window: String,
    /// Begin of the window, s; none = from the start.
    pub after_s: Option<f64>,
    /// End of the window, s; none = to the end.
    pub until_s: Option<f64>,
    /// Upper bound.
    pub at_most: Option<f64>,
    /// Lower bound.
    pub at_least: Option<f64>,
    /// Share of the seeds that must hold it; none = all.
    pub quantile: Option<f64>,
    /// True if the mean over the seeds is judged, not each run.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub mean: bool,
    /// Measured value; null = could not be measured, which is a failure.
    pub value: Option<f64>,
    /// True if the expectation held. A run that did not finish holds nothing.
    pub held: bool,
    /// Reason of its known failure, if it has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub known_failure: Option<String>,
    /// Bound of the known failure: a value beyond it is worse than known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub no_worse_than: Option<f64>,
}

impl ExpectationVerdict {
    /// The measured value, such as `dffrls_aekf_robust mass_error_rel_max from 10 s`.
    pub fn what(&self) -> String {
        let mean = if self.mean { ", mean of seeds" } else { "" };
        match &self.estimator {
            Some(name) => format!("{name} {}{}{mean}", self.metric, self.window),
            None => format!("{}{}{mean}", self.metric, self.window),
        }
    }

    /// Reason why the failure differs from the known failure: it could not be measured, or is worse. None if it is, or
    /// holds.
    pub(crate) fn beyond_known(&self) -> Option<String> {
        self.known_failure.as_ref().filter(|_| !self.held)?;
        let Some(value) = self.value else {
            return Some("could not be measured".into());
        };
        let worst = self.no_worse_than?;
        let is_worse = match self.at_most {
            Some(most) if value > most => value > worst,
            _ => value < worst,
        };
        is_worse.then(|| format!("{value:.4} is worse than {worst}"))
    }

    /// Outcome in a word: held, known failure or FAILED.
    pub fn word(&self) -> &'static str {
        match (self.held, &self.known_failure) {
            (true, _) => "held",
            (false, Some(_)) if self.beyond_known().is_none() => "known failure",
            _ => "FAILED",
        }
    }

    /// True if the value holds the bounds, in a run that finished or not.
    pub(crate) fn follows(&self, finished: bool) -> bool {
        finished && self.value.is_some_and(|x| self.mean || self.is_within(x))
    }

    /// True for a value within the bounds.
    pub(crate) fn is_within(&self, x: f64) -> bool {
        self.at_most.is_none_or(|m| x <= m) && self.at_least.is_none_or(|l| x >= l)
    }

    /// The bound as text, such as `≤ 0.032`.
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
    /// True for an estimator that is shown for reference only.
    pub fn is_for_reference(&self, estimator: &str) -> bool {
        let mut of = self.integrity.iter().filter(|i| i.estimator == estimator);
        of.any(|i| i.at_most.is_none())
    }

    /// True for an estimator that is judged; all count as judged, if none is.
    pub(crate) fn is_main(&self, estimator: &str) -> bool {
        let reference = |name: &str| self.is_for_reference(name);
        !reference(estimator) || self.estimators.keys().all(|name| reference(name))
    }

    /// Misleading share of an estimator's valid samples in a few words, such as `slope 55 %, known`: that of the
    /// quantity that is worst. A dash if nothing is valid.
    pub fn misleading(&self, estimator: &str) -> String {
        let of = self.integrity.iter().filter(|i| i.estimator == estimator);
        let judged = of.filter_map(|i| Some((i, i.share_words()?)));
        let worst = judged.max_by(|(a, _), (b, _)| {
            let fails = |i: &Integrity| i.outcome() == Outcome::Fails;
            fails(a)
                .cmp(&fails(b))
                .then(a.share().total_cmp(&b.share()))
                // of equal ones the first
                .then(b.quantity.cmp(&a.quantity))
        });
        worst.map_or("-".to_owned(), |(_, words)| words)
    }

    /// Checks that its verdicts follow from its values. The error says which does not.
    pub fn check(&self) -> Result<(), String> {
        let wrong = self
            .expectations
            .iter()
            .find(|v| v.held != v.follows(self.finished));
        if let Some(v) = wrong {
            return Err(format!(
                "{}: the verdict does not follow from the value",
                v.what()
            ));
        }
        match self.integrity.iter().find(|i| !i.is_possible()) {
            Some(i) => Err(format!(
                "{}: its counts of samples do not fit each other",
                i.estimator
            )),
            None => Ok(()),
        }
    }

    /// Content of the file.
    pub fn to_json(&self) -> String {
        // Strings and finite numbers: nothing in here can fail to serialise.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }
}
