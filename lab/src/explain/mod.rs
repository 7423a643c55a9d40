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
use crate::verdicts::interval::Interval;
use crate::verdicts::run_result::RunResult;
use serde::{Deserialize, Serialize};

/// Name of the file in the folder of a run.
pub const NAME: &str = "explain.json";
/// Explained errors, over all samples.
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
    /// Reason why there is no error without the source: the first of its runs that broke down.
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
    /// Value with all sources: root mean square over the seeds; null if it could not be measured.
    pub with_all: Option<f64>,
    /// Without each of the sources.
    pub without: Vec<Option<f64>>,
    /// 95 % intervals of the shares of the sources, over the seeds; null for a single seed.
    #[serde(default)]
    pub intervals: Vec<Option<[f64; 2]>>,
}

impl ErrorOf {
    /// Share of the mean square error that disappears without a source, at most 1; `None` if one of the two errors
    /// could not be measured.
    pub fn share(&self, source: usize) -> Option<f64> {
        let without = self.without.get(source).copied().flatten()?;
        let with_all = self.with_all.filter(|x| *x > 0.0)?;
        Some(1.0 - (without / with_all).powi(2))
    }

    /// The share of a source with its interval, such as `60 % (45 … 70)`; a dash if it could not be measured.
    pub fn share_words(&self, source: usize) -> String {
        let percent = |x: f64| (100.0 * x).round() + 0.0;
        let Some(share) = self.share(source).map(percent) else {
            return "-".to_owned();
        };
        match self.intervals.get(source).copied().flatten() {
            Some([low, high]) => format!("{share} % ({} … {})", percent(low), percent(high)),
            None => format!("{share} %"),
        }
    }

    /// The metric with its unit.
    pub(crate) fn title(&self) -> String {
        let unit = find(&self.metric).map_or("1", |m| m.unit);
        crate::text::with_unit(&self.metric, unit)
    }
}

impl Budget {
    /// Makes the budget from the runs with all sources, followed by the runs without each of the sources, with the
    /// seeds of each in a row. Sources without a change have no runs and are left out by the caller.
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
                    intervals: groups
                        .iter()
                        .map(|runs| interval([runs, all], name, metric))
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

    /// Estimator of the short form: this one if it has errors, else the first.
    fn shown<'a>(&'a self, wanted: Option<&'a str>) -> &'a str {
        let mut names = self.errors.iter().map(|e| e.estimator.as_str());
        let first = names.clone().next().unwrap_or_default();
        names.find(|name| wanted == Some(name)).unwrap_or(first)
    }

    /// The largest sources of an estimator's errors, three at most: places of single sources.
    pub fn greatest(&self, estimator: &str) -> Vec<usize> {
        let share = |source: usize| {
            let of = self.errors.iter().filter(|e| e.estimator == estimator);
            let shares = of.filter_map(|e| e.share(source));
            shares.fold(f64::NEG_INFINITY, f64::max)
        };
        let single = |name: &str| ![sources::ALL, sources::EXCITATION].contains(&name);
        let all = self.sources.iter().enumerate();
        let mut all: Vec<usize> = all.filter(|(_, s)| single(&s.name)).map(|s| s.0).collect();
        all.sort_by(|a, b| share(*b).total_cmp(&share(*a)));
        all.truncate(3);
        all
    }

    /// The short form for an estimator of the run: its name, and the greatest source of each of its errors in a
    /// sentence.
    pub fn sentence<'a>(&'a self, wanted: Option<&'a str>) -> (&'a str, String) {
        let name = self.shown(wanted);
        let greatest = self.greatest(name);
        let part = |(metric, what): (&str, &str)| {
            let error = self.of(metric).find(|e| e.estimator == name)?;
            let share = |source: &usize| error.share(*source).unwrap_or(f64::NEG_INFINITY);
            let most = greatest
                .iter()
                .max_by(|a, b| share(a).total_cmp(&share(b)))?;
            let source = &self.sources.get(*most)?.name;
            let words = error.share_words(*most);
            Some(match error.share(*most).filter(|share| *share > 0.0) {
                Some(_) => format!("{source} makes {words} of the {what} of {name}"),
                None => format!("no single source explains the {what} of {name}"),
            })
        };
        let parts = [(METRICS[1], "slope error"), (METRICS[0], "mass error")];
        let parts: Vec<String> = parts.into_iter().filter_map(part).collect();
        let (said, seeds) = (parts.join("; "), self.seeds.len());
        (name, format!("Over {seeds} seeds: {said}."))
    }

    /// The errors of one metric.
    pub fn of(&self, metric: &str) -> impl Iterator<Item = &ErrorOf> {
        self.errors.iter().filter(move |e| e.metric == metric)
    }
}

/// Interval of the share of the mean square error that disappears in the first runs; `None` unless all runs were
/// measured.
fn interval(runs: [&[RunResult]; 2], estimator: &str, metric: &str) -> Option<[f64; 2]> {
    let [without, with] = runs.map(|runs| values(runs, estimator, metric));
    let pairs = without?.into_iter().zip(with?);
    let pairs: Vec<(f64, f64)> = pairs.map(|(a, b)| (a * a, b * b)).collect();
    let ratio = Interval::ratio(&pairs)?;
    Some([1.0 - ratio.high, 1.0 - ratio.low])
}

/// A metric in each of the runs; `None` unless it was measured in all runs.
fn values(runs: &[RunResult], estimator: &str, metric: &str) -> Option<Vec<f64>> {
    let value = |run: &RunResult| {
        let summary = run.summary.as_ref().filter(|s| s.finished)?;
        let of = summary.estimators.get(estimator)?;
        of.get(metric).copied().flatten()
    };
    runs.iter().map(value).collect()
}

/// Value over the runs; `None` unless it was measured in all runs.
fn root_mean_square(runs: &[RunResult], estimator: &str, metric: &str) -> Option<f64> {
    let values = values(runs, estimator, metric)?;
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
            intervals: vec![Some([0.25, 0.4])],
        };
        let shares: Vec<Option<f64>> = (0..5).map(|i| error.share(i)).collect();
        let near = |i: usize, x: f64| (shares[i].unwrap() - x).abs() < 1e-12;
        assert!(near(0, 9.0 / 25.0) && near(1, 16.0 / 25.0));
        assert!(near(3, -3.0), "what gets worse is negative");
        assert!(shares[2].is_none() && shares[4].is_none());
        let words = [0, 1, 2].map(|i| error.share_words(i));
        assert_eq!(words, ["36 % (25 … 40)", "64 %", "-"]);
    }
}
