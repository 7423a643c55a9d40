//! `metrics.json`: the numbers of one run, and whether what its scenario expects held. The same run gives the same bytes.

use crate::metrics::{self, METRICS, RUN_METRICS};
use crate::series::Series;
use monorig_sim::run::Outcome;
use monorig_sim::scenario::{Expectation, Scenario};
use serde::Serialize;
use std::collections::BTreeMap;

/// Metrics are taken from here on unless an expectation says otherwise, s: the start belongs to nobody.
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
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Format version, 1.
    pub version: u32,
    /// Scenario name.
    pub scenario: String,
    /// Seed.
    pub seed: u64,
    /// Whether the scenario's end was reached.
    pub finished: bool,
    /// Simulated time, s.
    pub simulated_s: f64,
    /// Steps of the plant.
    pub steps: u64,
    /// Metrics are taken from here on, s.
    pub after_s: f64,
    /// Per estimator: its metrics; null = could not be measured.
    pub estimators: BTreeMap<String, BTreeMap<&'static str, Option<f64>>>,
    /// Metrics of train and controller.
    pub run: BTreeMap<&'static str, Option<f64>>,
    /// Steps refused by an estimator: name, how many, first reason.
    pub refusals: Vec<(String, u64, String)>,
    /// What the scenario expects.
    pub expectations: Vec<Verdict>,
}

/// One expectation, judged.
#[derive(Clone, Debug, Serialize)]
pub struct Verdict {
    /// Estimator, if it is about one.
    pub estimator: Option<String>,
    /// Metric.
    pub metric: String,
    /// Measured value; null = could not be measured, which is a failure.
    pub value: Option<f64>,
    /// Bound in words.
    pub bound: String,
    /// Whether it held. A run that did not finish holds nothing.
    pub held: bool,
}

fn finite(x: Option<f64>) -> Option<f64> {
    x.filter(|x| x.is_finite())
}

impl Summary {
    /// The numbers of a run.
    pub fn new(scenario: &Scenario, seed: u64, outcome: &Outcome, series: &Series) -> Self {
        let (from, to) = (AFTER_S, f64::INFINITY);
        let of = |name: &str| {
            METRICS
                .iter()
                .map(|m| {
                    (
                        m.name,
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
            simulated_s: outcome.simulated_s,
            steps: outcome.steps,
            after_s: AFTER_S,
            estimators: series
                .estimators
                .iter()
                .map(|(name, _)| (name.clone(), of(name)))
                .collect(),
            run: RUN_METRICS
                .iter()
                .map(|m| (m.0, finite(metrics::measure_run(series, m.0, from, to))))
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

fn judge(e: &Expectation, series: &Series, finished: bool) -> Verdict {
    let from = e.after_s.map_or(0.0, f64::from);
    let to = e.until_s.map_or(f64::INFINITY, f64::from);
    let value = finite(match &e.estimator {
        Some(name) => metrics::measure(series, name, &e.metric, from, to),
        None => metrics::measure_run(series, &e.metric, from, to),
    });
    let (most, least) = (e.at_most.map(f64::from), e.at_least.map(f64::from));
    let within = |x: f64| most.is_none_or(|m| x <= m) && least.is_none_or(|l| x >= l);
    let bound = [
        most.map(|m| format!("≤ {m}")),
        least.map(|l| format!("≥ {l}")),
    ];
    Verdict {
        estimator: e.estimator.clone(),
        metric: e.metric.clone(),
        value,
        bound: bound
            .into_iter()
            .flatten()
            .collect::<Vec<_>>()
            .join(" and "),
        held: finished && value.is_some_and(within),
    }
}
