//! Comparison with the verdicts of an earlier test: which metrics have become worse?

use crate::ui::errors::CliError;
use monorig_lab::metrics;
use monorig_lab::verdicts::run_result::RunResult;
use monorig_lab::verdicts::verdict::{Check, ScenarioVerdict};
use monorig_sim::config::file::{input_error, read_result};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Content of the file that `--json` writes.
#[derive(Deserialize)]
struct Verdicts {
    kind: String,
    scenarios: Vec<ScenarioVerdict>,
}

/// The verdicts of an earlier test, by scenario.
pub struct Baseline {
    path: PathBuf,
    scenarios: BTreeMap<String, Vec<RunResult>>,
}

/// Metrics that are compared beside the metrics in a scenario's `expect`: accuracy, availability and integrity.
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

impl Baseline {
    /// Reads a file of `monorig test --json`.
    pub fn read(path: &Path) -> Result<Self, CliError> {
        let wrong = |message: String| {
            let help = "use a file that `monorig test --json FILE` wrote";
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
        for verdict in &read.scenarios {
            verdict.check().map_err(wrong)?;
        }
        let scenarios = read.scenarios.into_iter().map(|s| (s.scenario, s.runs));
        Ok(Self {
            path: path.into(),
            scenarios: scenarios.collect(),
        })
    }

    /// Refuses a baseline without a run of these scenarios and seeds: there would be nothing to compare.
    pub fn shares<'a>(
        &self,
        tested: impl Iterator<Item = (&'a str, &'a [(u64, u64)])>,
    ) -> Result<(), CliError> {
        let mut tested = tested;
        let common = |(name, runs): (&str, &[(u64, u64)])| {
            let before = self.scenarios.get(name);
            let mut before = before.into_iter().flatten();
            before.any(|r| runs.iter().any(|(_, seed)| *seed == r.seed))
        };
        match tested.any(common) {
            true => Ok(()),
            false => Err(CliError::Sim(input_error(
                &self.path,
                "",
                "this baseline has no scenario and seed of this test, so there is nothing to compare",
                "use a file that `monorig test --json FILE` wrote for some of these scenarios and seeds",
            ))),
        }
    }

    /// Adds a check for each metric that is worse than in the baseline by more than the share `worse_than`, or can no
    /// longer be measured; returns the numbers of compared and of worse metrics. A scenario that is not in the baseline
    /// gets no check.
    pub fn judge(&self, judged: &mut ScenarioVerdict, worse_than: f64) -> (usize, usize) {
        let Some(before) = self.scenarios.get(&judged.scenario) else {
            return (0, 0);
        };
        let (mut compared, mut worse) = (0, 0);
        for (estimator, metric) in pairs(&judged.runs) {
            let common = |runs: &[RunResult], others: &[RunResult]| {
                let seeds = |r: &&RunResult| others.iter().any(|o| o.seed == r.seed);
                mean(runs.iter().filter(seeds), &estimator, &metric)
            };
            let (now, then) = (common(&judged.runs, before), common(before, &judged.runs));
            compared += usize::from(then.is_some());
            if is_worse(&metric, then, now, worse_than) {
                worse += 1;
                judged.add(Check::made_elsewhere(
                    format!("{estimator} {metric} over the common seeds"),
                    format!(
                        "not worse than the baseline by more than {} %",
                        100.0 * worse_than
                    ),
                    Some(words(then, now)),
                ));
            }
        }
        if compared == 0 {
            judged.add(Check::made_elsewhere(
                "the baseline".into(),
                "has a metric in common".into(),
                Some("the two tests have no common estimator, seed and metric".into()),
            ));
        }
        (compared, worse)
    }
}

/// Present and earlier value of a metric, in words.
fn words(before: Option<f64>, now: Option<f64>) -> String {
    let value = |x: Option<f64>| x.map_or("not measured".to_owned(), |x| format!("{x:.4}"));
    let change = match (before, now) {
        (Some(a), Some(b)) if a != 0.0 => format!(" ({:+.1} %)", 100.0 * (b - a) / a.abs()),
        _ => String::new(),
    };
    format!("worse: {}, was {}{change}", value(now), value(before))
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

/// Mean of a whole-run metric over the runs; `None` if a run could not be measured.
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

/// Returns true if a metric is worse or can no longer be measured. Metrics that should be 1 are not judged.
fn is_worse(metric: &str, before: Option<f64>, now: Option<f64>, worse_than: f64) -> bool {
    let best = metrics::find(metric).and_then(|m| m.best.less_is_better());
    match (best, before, now) {
        (Some(_), Some(_), None) => true,
        (Some(true), Some(before), Some(now)) => now > before + worse_than * before.abs(),
        (Some(false), Some(before), Some(now)) => now < before - worse_than * before.abs(),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
