//! An error budget: the same drive again and again, each time without one source of error, and how much of the error
//! is gone.
//!
//! Errors of sources that do not act on each other add as squares, so that the share of a source is that of the mean
//! square error that is gone without it (one source at a time: ISO/IEC Guide 98-3, 5.1). Where sources act on each
//! other the shares do not add up to one, and a share can be negative.

mod excitation;
mod sources;

pub use sources::{Source, sources};

use crate::metrics::find;
use crate::verdicts::run_result::RunResult;
use serde::{Deserialize, Serialize};

/// Name of the file in the folder of a run.
pub const NAME: &str = "explain.json";
/// The errors that are explained, all samples.
pub const METRICS: [&str; 3] = ["mass_rmse_kg", "slope_rmse_deg", "effective_slope_rmse_deg"];

/// The error budget of the estimators of a scenario.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Budget {
    /// Format version, 1.
    pub(crate) version: u32,
    /// Kind of the file: `explain`.
    pub(crate) kind: String,
    /// Version of monorig.
    pub(crate) monorig: String,
    /// Name of the run's scenario, with its variant.
    pub scenario: String,
    /// True if files of the run were changed before the budget was made: it is of what they said then.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub changed: bool,
    /// Seeds of the runs, the same for every source.
    pub seeds: Vec<u64>,
    /// Sources that were switched off, in the order of [`ErrorOf::without`].
    pub sources: Vec<SwitchedOff>,
    /// The errors of each estimator.
    pub errors: Vec<ErrorOf>,
}

/// A source of error.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SwitchedOff {
    /// Its name.
    pub name: String,
    /// Description of the source.
    pub(crate) what: String,
    /// Why there is no error without it: the first of its runs that broke down.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failed: Option<String>,
}

/// One error of one estimator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorOf {
    /// Estimator.
    pub estimator: String,
    /// Metric.
    pub metric: String,
    /// With everything as it is: root mean square over the seeds; null if it could not be measured.
    pub with_all: Option<f64>,
    /// Without each of the sources.
    pub without: Vec<Option<f64>>,
}

impl ErrorOf {
    /// Share of the mean square error that is gone without a source, 1 at most; none if one of the two could not be
    /// measured.
    pub fn share(&self, source: usize) -> Option<f64> {
        let without = self.without.get(source).copied().flatten()?;
        let with_all = self.with_all.filter(|x| *x > 0.0)?;
        Some(1.0 - (without / with_all).powi(2))
    }

    /// The metric with its unit.
    pub(crate) fn title(&self) -> String {
        let unit = find(&self.metric).map_or("1", |m| m.unit);
        crate::text::with_unit(&self.metric, unit)
    }
}

impl Budget {
    /// From the runs with everything, then those without each of the sources, the seeds of each in a row. Sources
    /// without a change have no runs and are left out by the caller.
    pub fn new(
        monorig: String,
        scenario: String,
        seeds: Vec<u64>,
        sources: &[Source],
        runs: &[RunResult],
    ) -> Self {
        let mut groups = runs.chunks(seeds.len().max(1));
        let all = groups.next().unwrap_or_default();
        let groups: Vec<&[RunResult]> = groups.collect();
        let names = all.iter().filter_map(|r| r.summary.as_ref());
        let mut names: Vec<&String> = names.flat_map(|s| s.estimators.keys()).collect();
        names.sort_unstable();
        names.dedup();
        let mut errors = Vec::new();
        for metric in METRICS {
            errors.extend(names.iter().map(|name| {
                ErrorOf {
                    estimator: (*name).clone(),
                    metric: metric.into(),
                    with_all: root_mean_square(all, name, metric),
                    without: groups
                        .iter()
                        .map(|runs| root_mean_square(runs, name, metric))
                        .collect(),
                }
            }));
        }
        errors.retain(|e| e.with_all.is_some());
        let sources = sources
            .iter()
            .zip(&groups)
            .map(|(source, runs)| SwitchedOff {
                name: source.name.into(),
                what: source.what.clone(),
                failed: runs.iter().find_map(|r| r.error.clone()),
            });
        Self {
            version: 1,
            kind: "explain".into(),
            monorig,
            scenario,
            changed: false,
            sources: sources.collect(),
            seeds,
            errors,
        }
    }

    /// The errors of one metric.
    pub fn of(&self, metric: &str) -> impl Iterator<Item = &ErrorOf> {
        self.errors.iter().filter(move |e| e.metric == metric)
    }
}

/// Over the runs; none unless it was measured in all of them.
fn root_mean_square(runs: &[RunResult], estimator: &str, metric: &str) -> Option<f64> {
    let values = runs.iter().map(|run| {
        let summary = run.summary.as_ref().filter(|s| s.finished)?;
        summary
            .estimators
            .get(estimator)?
            .get(metric)
            .copied()
            .flatten()
    });
    let values = values.collect::<Option<Vec<f64>>>()?;
    let n = values.len();
    let squares: f64 = values.iter().map(|x| x * x).sum();
    (n > 0).then(|| (squares / n as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Independent errors add as squares: 3 and 4 make 5, and their shares are 9/25 and 16/25.
    #[test]
    fn shares_of_independent_errors_add_up_to_one() {
        let error = ErrorOf {
            estimator: "e".into(),
            metric: "slope_rmse_deg".into(),
            with_all: Some(5.0),
            without: vec![Some(4.0), Some(3.0), None, Some(10.0)],
        };
        let shares: Vec<Option<f64>> = (0..5).map(|i| error.share(i)).collect();
        let near = |i: usize, x: f64| (shares[i].unwrap() - x).abs() < 1e-12;
        assert!(near(0, 9.0 / 25.0) && near(1, 16.0 / 25.0));
        assert!(near(3, -3.0), "what gets worse is negative");
        assert!(shares[2].is_none() && shares[4].is_none());
    }
}
