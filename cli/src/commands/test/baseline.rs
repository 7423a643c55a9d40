//! Verdicts against those of an earlier test: which metrics have become worse?

use crate::ui::errors::CliError;
use crate::verdicts::TestedScenario;
use monorig_lab::metrics;
use monorig_lab::verdicts::run_result::RunResult;
use monorig_lab::verdicts::verdict::ScenarioVerdict;
use monorig_sim::config::file::{input_error, read_result};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

/// The file that `--json` writes.
#[derive(Deserialize)]
struct Verdicts {
    kind: String,
    scenarios: Vec<ScenarioVerdict>,
}

/// The verdicts of an earlier test, by scenario.
pub struct Baseline {
    scenarios: BTreeMap<String, Vec<RunResult>>,
}

/// Metrics compared beside those that a scenario expects something of: accuracy, availability and integrity.
const ALWAYS: &[&str] = &[
    "mass_rmse_kg",
    "mass_rmse_kg_valid",
    "mass_availability",
    "mass_misleading_share",
    "slope_rmse_deg",
    "slope_rmse_deg_valid",
    "slope_availability",
    "slope_misleading_share",
];

/// A metric that has become worse: the means over the seeds that both tests have.
#[derive(Debug, PartialEq)]
pub struct Worse {
    /// Scenario, estimator and metric.
    pub what: String,
    /// Mean in the baseline; none = it could not be measured.
    pub before: Option<f64>,
    /// Mean now.
    pub now: Option<f64>,
}

impl Worse {
    /// As a line.
    pub fn text(&self) -> String {
        let value = |x: Option<f64>| x.map_or("not measured".to_owned(), |x| format!("{x:.4}"));
        let change = match (self.before, self.now) {
            (Some(a), Some(b)) if a != 0.0 => format!(" ({:+.1} %)", 100.0 * (b - a) / a.abs()),
            _ => String::new(),
        };
        format!(
            "worse   {}: {}, was {}{change}",
            self.what,
            value(self.now),
            value(self.before)
        )
    }
}

impl Baseline {
    /// Read what `monorig test --json` wrote.
    pub fn read(path: &Path) -> Result<Self, CliError> {
        let wrong = |message: String| {
            let help = "a file that `monorig test --json FILE` wrote";
            CliError::Sim(input_error(path, "", message, help))
        };
        let text = read_result(path)?;
        let read: Verdicts = serde_json::from_str(&text)
            .map_err(|e| wrong(format!("these are not the verdicts of a test: {e}")))?;
        if read.kind != "test" {
            return Err(wrong(format!(
                "this is a `{}`, not the verdicts of a test",
                read.kind
            )));
        }
        let scenarios = read.scenarios.into_iter().map(|s| (s.scenario, s.runs));
        Ok(Self {
            scenarios: scenarios.collect(),
        })
    }

    /// Returns the metrics that are worse by more than the share `worse_than`, and how many were compared.
    pub fn compare(&self, tested: &[TestedScenario], worse_than: f64) -> (Vec<Worse>, usize) {
        let (mut worse, mut compared) = (Vec::new(), 0);
        for one in tested {
            let Some(before) = self.scenarios.get(&one.judged.scenario) else {
                continue;
            };
            for (estimator, metric) in pairs(&one.judged.runs) {
                let common = |runs: &[RunResult], others: &[RunResult]| {
                    let seeds = |r: &&RunResult| others.iter().any(|o| o.seed == r.seed);
                    mean(runs.iter().filter(seeds), &estimator, &metric)
                };
                let (now, then) = (
                    common(&one.judged.runs, before),
                    common(before, &one.judged.runs),
                );
                compared += usize::from(then.is_some());
                if is_worse(&metric, then, now, worse_than) {
                    worse.push(Worse {
                        what: format!("{} {estimator} {metric}", one.judged.scenario),
                        before: then,
                        now,
                    });
                }
            }
        }
        (worse, compared)
    }
}

/// Estimators and metrics to compare.
fn pairs(runs: &[RunResult]) -> Vec<(String, String)> {
    let summaries = || runs.iter().filter_map(|r| r.summary.as_ref());
    let mut pairs = std::collections::BTreeSet::new();
    for summary in summaries() {
        for name in summary.estimators.keys() {
            pairs.extend(ALWAYS.iter().map(|m| (name.clone(), (*m).to_owned())));
        }
        for v in &summary.expectations {
            pairs.extend(v.estimator.clone().map(|name| (name, v.metric.clone())));
        }
    }
    pairs.into_iter().collect()
}

/// Mean over the runs of a metric of the whole run; none if one of them could not be measured.
fn mean<'a>(
    runs: impl Iterator<Item = &'a RunResult>,
    estimator: &str,
    metric: &str,
) -> Option<f64> {
    let values: Option<Vec<f64>> = runs
        .map(|run| {
            *run.summary
                .as_ref()?
                .estimators
                .get(estimator)?
                .get(metric)?
        })
        .collect();
    let values = values.filter(|v| !v.is_empty())?;
    Some(values.iter().sum::<f64>() / values.len() as f64)
}

/// Returns whether a metric is worse; one that can no longer be measured is. Metrics that should be 1 are not judged.
fn is_worse(metric: &str, before: Option<f64>, now: Option<f64>, worse_than: f64) -> bool {
    let best = metrics::find(metric).and_then(|m| m.best.less_is_better());
    match (best, before, now) {
        (Some(_), Some(_), None) => true,
        (Some(true), Some(before), Some(now)) => now > before + worse_than * before.abs(),
        (Some(false), Some(before), Some(now)) => now < before - worse_than * before.abs(),
        _ => false,
    }
}

/// A share as `5%` or `0.05`.
pub fn share(text: &str) -> Result<f64, String> {
    let (number, scale) = match text.trim().strip_suffix('%') {
        Some(number) => (number, 0.01),
        None => (text, 1.0),
    };
    let share = number.trim().parse::<f64>().map(|x| x * scale);
    share
        .ok()
        .filter(|x| (0.0..=10.0).contains(x))
        .ok_or_else(|| "write a share such as 5% or 0.05".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_read() {
        assert_eq!(share("5%"), Ok(0.05));
        assert_eq!(share(" 0.1 "), Ok(0.1));
        assert!(share("five").is_err() && share("-1%").is_err() && share("nan").is_err());
    }

    #[test]
    fn worse_is_more_of_an_error_and_less_of_a_share() {
        let worse = |metric: &str, before, now| is_worse(metric, before, now, 0.05);
        assert!(!worse("slope_rmse_deg", Some(0.10), Some(0.104)));
        assert!(worse("slope_rmse_deg", Some(0.10), Some(0.106)));
        assert!(!worse("slope_rmse_deg", Some(0.10), Some(0.01)));
        assert!(worse("mass_availability", Some(0.5), Some(0.4)));
        assert!(!worse("mass_availability", Some(0.5), Some(0.9)));
        assert!(worse("slope_rmse_deg", Some(0.10), None));
        assert!(!worse("slope_rmse_deg", None, Some(0.10)));
        // nothing misled before: anything is worse
        assert!(worse("mass_misleading_share", Some(0.0), Some(0.01)));
        assert!(!worse("no_metric", Some(0.1), Some(9.0)));
    }
}
