//! `metrics.json`: the numbers of one run, and whether what its scenario expects held. The same run gives the same bytes.

use crate::metrics;
use crate::metrics::series::ErrorSeries;
use crate::metrics::{estimator_metrics, run_metrics};
use monorig_sim::closed_loop::run::Outcome;
use monorig_sim::config::scenario::{Expectation, Scenario};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Metrics are taken from here on unless an expectation says otherwise, s: the transient at the start does not count.
pub const AFTER_S: f64 = 5.0;
/// The metrics shown first.
pub const MAIN: &[&str] = &[
    "mass_rmse_kg",
    "mass_error_rel_max",
    "mass_convergence_s",
    "slope_rmse_deg",
    "slope_effective_rmse_deg",
    "slope_valid_share",
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
    /// Whether the scenario's end was reached.
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
    /// What the scenario expects.
    pub expectations: Vec<ExpectationVerdict>,
}

/// One expectation, judged.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ExpectationVerdict {
    /// Estimator, if it is about one.
    pub estimator: Option<String>,
    /// Metric.
    pub metric: String,
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
    /// Whether it held. A run that did not finish holds nothing.
    pub held: bool,
}

impl ExpectationVerdict {
    /// What is measured, such as `dffrls_aekf_robust mass_error_rel_max from 10 s`.
    pub fn what(&self) -> String {
        let mut text = match &self.estimator {
            Some(name) => format!("{name} {}", self.metric),
            None => self.metric.clone(),
        };
        if let Some(from) = self.after_s {
            text += &format!(" from {from} s");
        }
        if let Some(to) = self.until_s {
            text += &format!(" to {to} s");
        }
        text
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

    /// How far the value is beyond its bound, as a share of the bound's size; infinite when it could not be measured.
    pub fn excess(&self) -> f64 {
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

fn finite(x: Option<f64>) -> Option<f64> {
    x.filter(|x| x.is_finite())
}

impl Summary {
    /// The numbers of a run.
    pub fn new(scenario: &Scenario, seed: u64, outcome: &Outcome, series: &ErrorSeries) -> Self {
        let (from, to) = (AFTER_S, f64::INFINITY);
        let of = |name: &str| {
            estimator_metrics()
                .map(|m| {
                    (
                        m.name.to_owned(),
                        finite(metrics::measure(series, name, m.name, from, to)),
                    )
                })
                .collect()
        };
        Self {
            version: 1,
            scenario: scenario.name.clone(),
            seed,
            finished: outcome.finished,
            never_valid: series
                .estimators
                .iter()
                .filter(|(_, samples)| !samples.iter().any(|x| x.mass_valid || x.slope_valid))
                .map(|(name, _)| name.clone())
                .collect(),
            simulated_s: outcome.simulated_s,
            steps: outcome.steps,
            after_s: AFTER_S,
            estimators: series
                .estimators
                .iter()
                .map(|(name, _)| (name.clone(), of(name)))
                .collect(),
            run: run_metrics()
                .map(|m| {
                    (
                        m.name.to_owned(),
                        finite(metrics::measure_run(series, m.name, from, to)),
                    )
                })
                .collect(),
            refusals: outcome.refusals.clone(),
            expectations: scenario
                .file
                .expect
                .iter()
                .map(|e| judge(e, series, outcome.finished))
                .collect(),
        }
    }

    /// As it stands in the file.
    pub fn to_json(&self) -> String {
        // Strings and finite numbers: nothing in here can fail to serialise.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }
}

fn judge(e: &Expectation, series: &ErrorSeries, finished: bool) -> ExpectationVerdict {
    let (after_s, until_s) = (e.after_s.map(f64::from), e.until_s.map(f64::from));
    let (from, to) = (after_s.unwrap_or(0.0), until_s.unwrap_or(f64::INFINITY));
    let value = finite(match &e.estimator {
        Some(name) => metrics::measure(series, name, &e.metric, from, to),
        None => metrics::measure_run(series, &e.metric, from, to),
    });
    let (at_most, at_least) = (e.at_most.map(f64::from), e.at_least.map(f64::from));
    let within = |x: f64| at_most.is_none_or(|m| x <= m) && at_least.is_none_or(|l| x >= l);
    ExpectationVerdict {
        estimator: e.estimator.clone(),
        metric: e.metric.clone(),
        after_s,
        until_s,
        at_most,
        at_least,
        quantile: e.quantile.map(f64::from),
        value,
        held: finished && value.is_some_and(within),
    }
}
