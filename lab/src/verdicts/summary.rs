//! `metrics.json`: the numbers of one run, and whether what its scenario expects held. The same run gives the same bytes.

use crate::metrics;
use crate::metrics::series::{ErrorSample, ErrorSeries};
use crate::metrics::{Quantity, estimator_metrics, run_metrics};
use crate::verdicts::expected::{self, Bound};
use crate::verdicts::integrity::Integrity;
use monorig_sim::closed_loop::run::Outcome;
use monorig_sim::config::scenario::{IntegrityLimits, Moment, Scenario, ScenarioFile};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Metrics are taken from here on unless an expectation says otherwise, s: the transient at the start does not count.
pub const AFTER_S: f64 = 5.0;
/// The metrics shown first.
pub const MAIN: &[&str] = &[
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
    /// What the scenario expects, and what follows from it.
    pub expectations: Vec<ExpectationVerdict>,
    /// When a valid sample is misleading.
    #[serde(default)]
    pub limits: IntegrityLimits,
    /// Integrity of every estimator and quantity.
    #[serde(default)]
    pub integrity: Vec<Integrity>,
    /// Of estimators against the reference of a comparison: errors over the samples that both mark valid. Empty elsewhere.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub common: BTreeMap<String, CommonErrors>,
}

/// Errors of an estimator and of the reference over the samples that both mark valid.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CommonErrors {
    /// By quantity: the share of all samples that both mark valid.
    pub share: BTreeMap<Quantity, f64>,
    /// By metric: the estimator's and the reference's; null = could not be measured.
    pub errors: BTreeMap<String, [Option<f64>; 2]>,
}

impl CommonErrors {
    /// Of two estimators over the same steps.
    fn of(own: &[ErrorSample], reference: &[ErrorSample]) -> Self {
        let share = Quantity::ALL.map(|q| {
            let pairs = own.iter().zip(reference);
            let both = pairs
                .filter(|(a, b)| q.is_valid(a) && q.is_valid(b))
                .count();
            (q, both as f64 / own.len().max(1) as f64)
        });
        let errors = estimator_metrics().filter(|m| !m.is_of_valid());
        let errors = errors.filter_map(|m| {
            let ours = m.over_common(own, reference)?;
            let theirs = m.over_common(reference, own)?;
            Some((
                m.name.to_owned(),
                [finite(Some(ours)), finite(Some(theirs))],
            ))
        });
        Self {
            share: share.into_iter().collect(),
            errors: errors.collect(),
        }
    }
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
    /// Whether it held. A run that did not finish holds nothing.
    pub held: bool,
    /// Why it is known not to hold, if it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub known_failure: Option<String>,
}

impl ExpectationVerdict {
    /// What is measured, such as `dffrls_aekf_robust mass_error_rel_max from 10 s`.
    pub fn what(&self) -> String {
        match &self.estimator {
            Some(name) => format!("{name} {}{}", self.metric, self.window),
            None => format!("{}{}", self.metric, self.window),
        }
    }

    /// Whether it is as it should be: it held, or it is known not to.
    pub fn good(&self) -> bool {
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
            expectations: expected::bounds(&scenario.file)
                .iter()
                .map(|b| judge(b, &scenario.file, series, outcome.finished))
                .collect(),
            limits: series.limits,
            integrity: Integrity::of(series, &scenario.file),
            common: BTreeMap::new(),
        }
    }

    /// With the errors of every other estimator on the samples that it and the reference both mark valid.
    pub fn against(mut self, reference: &str, series: &ErrorSeries) -> Self {
        let later =
            |samples| metrics::between(samples, |x: &ErrorSample| x.t_s, AFTER_S, f64::INFINITY);
        let Some(theirs) = series.of(reference).map(later) else {
            return self;
        };
        let others = series
            .estimators
            .iter()
            .filter(|(name, _)| name != reference);
        self.common = others
            .map(|(name, own)| (name.clone(), CommonErrors::of(later(own), theirs)))
            .collect();
        self
    }

    /// Whether the run is good: it finished, every bound held or is known not to, and no estimator in it that is judged is misleading.
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

fn judge(
    bound: &Bound,
    file: &ScenarioFile,
    series: &ErrorSeries,
    finished: bool,
) -> ExpectationVerdict {
    let e = &bound.expectation;
    // beyond the end of the run if it never comes to where the window begins, or ends
    let end = |s: Option<f64>, moment: &Option<Moment>| match moment {
        Some(moment) => Some(series.instant_s(moment, file).unwrap_or(f64::INFINITY)),
        None => s,
    };
    let after_s = end(e.after_s.map(f64::from), &e.after);
    let until_s = end(e.until_s.map(f64::from), &e.until);
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
        window: e.window(),
        after_s: finite(after_s),
        until_s: finite(until_s),
        at_most,
        at_least,
        quantile: e.quantile.map(f64::from),
        value,
        held: finished && value.is_some_and(within),
        known_failure: bound.known_failure.clone(),
    }
}
