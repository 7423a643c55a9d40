//! Estimators against each other on the same runs: means with confidence intervals, paired differences, published
//! figures.

use crate::metrics::{Marks, Quantity, VALID, find, mark};
use crate::verdicts::interval::Interval;
use crate::verdicts::run_result::RunResult;
use monorig_sim::config::scenario::{Published, Settings};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Metrics that are compared by default, and further metrics if the runs have a bound.
const USUAL_METRICS: [&str; 8] = [
    "mass_rmse_kg",
    "mass_error_converged_rel_max",
    "slope_rmse_deg",
    "slope_mae_deg",
    "mass_misleading_share",
    "mass_overconfident_share",
    "slope_misleading_share",
    "slope_overconfident_share",
];
const OVER_BOUND: [&str; 3] = [
    "slope_rmse_over_bound",
    "effective_slope_rmse_over_bound",
    "mass_rmse_over_bound",
];

/// One metric of one estimator over all runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ComparedMetric {
    /// Estimator.
    pub estimator: String,
    /// Metric.
    pub metric: String,
    /// Number of runs in which the metric could be measured.
    pub measured: usize,
    /// Number of all runs.
    pub runs: usize,
    /// Mean over these runs; none with fewer than two.
    pub mean: Option<Interval>,
    /// Median over these runs.
    pub median: Option<f64>,
    /// An error over the samples that the estimator marks valid; `None` if it is not an error.
    pub valid: Option<OnSamples>,
    /// An error over the samples that both the estimator and the reference mark valid; `None` for the reference, and
    /// if it is not an error.
    pub common: Option<OnSamples>,
    /// Mean of estimator minus reference, run by run: of an error on the samples that both mark valid, of another
    /// metric over the runs in which both could be measured; none for the reference.
    pub difference: Option<Interval>,
    /// The published value.
    pub published: Option<Published>,
}

/// An error on some of the samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OnSamples {
    /// Share of the samples that count, mean over the runs; none without a run.
    pub share: Option<f64>,
    /// Number of runs with such a sample.
    pub(crate) measured: usize,
    /// Mean over these runs; none with fewer than two.
    pub mean: Option<Interval>,
    /// Median over these runs.
    pub(crate) median: Option<f64>,
}

impl OnSamples {
    fn new(values: &[Option<f64>], shares: &[Option<f64>]) -> Self {
        let measured: Vec<f64> = values.iter().flatten().copied().collect();
        let shares: Vec<f64> = shares.iter().flatten().copied().collect();
        Self {
            share: (!shares.is_empty()).then(|| shares.iter().sum::<f64>() / shares.len() as f64),
            measured: measured.len(),
            mean: Interval::bootstrap(&measured),
            median: median(&measured),
        }
    }
}

/// Estimators compared: what `monorig compare --json` writes.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Comparison {
    /// Format version, 1.
    pub version: u32,
    /// Kind of the file: `compare`.
    pub kind: String,
    /// Version of monorig.
    pub monorig: String,
    /// Scenario.
    pub scenario: String,
    /// The estimators of the runs with their types and parameters.
    #[serde(default)]
    pub estimators: BTreeMap<String, Settings>,
    /// Reference, with which the other estimators are compared.
    pub reference: String,
    /// Every metric of every estimator, metrics outermost.
    pub table: Vec<ComparedMetric>,
    /// The runs, one for each seed.
    pub runs: Vec<RunResult>,
}

/// An error of an estimator as a multiple of the reference's, on the samples that both mark valid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorRatio {
    /// The mean error over the mean error of the reference.
    pub ratio: f64,
    /// Interval of the ratio over the runs; none with fewer than two runs.
    pub interval: Option<Interval>,
    /// Share of all samples that both mark valid.
    pub share: f64,
}

impl ErrorRatio {
    /// Ratio for a metric; `None` if the metric is not an error, or there is no common sample.
    pub fn of(runs: &[RunResult], estimator: &str, metric: &str) -> Option<Self> {
        let quantity = quantity(metric)?;
        let [own, theirs] = common(runs, estimator, metric);
        let pairs = own.into_iter().zip(theirs);
        let pairs: Vec<(f64, f64)> = pairs.filter_map(|(a, b)| Some((a?, b?))).collect();
        let shares = runs.iter().filter_map(|run| {
            let summary = run.whole()?;
            summary.common.get(estimator)?.share.get(&quantity).copied()
        });
        let shares: Vec<f64> = shares.collect();
        let sum = |of: fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>();
        let ratio = sum(|p| p.0) / sum(|p| p.1);
        ratio.is_finite().then(|| Self {
            ratio,
            interval: Interval::ratio(&pairs),
            share: shares.iter().sum::<f64>() / shares.len() as f64,
        })
    }

    /// Such as `0.18 ± 0.02`: behind the sign half of the 95 % interval.
    pub fn words(&self) -> String {
        match self.interval {
            Some(i) if i.mean >= 10.0 => {
                format!("{:.0} ± {:.0}", self.ratio, 0.5 * (i.high - i.low))
            }
            Some(i) => format!("{:.2} ± {:.2}", self.ratio, 0.5 * (i.high - i.low)),
            None => format!("{:.2}", self.ratio),
        }
    }

    /// True if the interval or, without an interval, the ratio lies below 1.
    fn is_less(&self) -> bool {
        self.interval.map_or(self.ratio, |i| i.high) < 1.0
    }
}

/// Least share of common samples with the reference for the ranking of an estimator.
const RANKED_SHARE: f64 = 0.5;

/// Result of a comparison: a sentence for each of the two main errors, if compared.
pub fn sentences(
    runs: &[RunResult],
    estimators: &[String],
    metrics: &[String],
    reference: &str,
) -> Vec<String> {
    let others: Vec<&String> = estimators.iter().filter(|e| *e != reference).collect();
    let main = [
        ("slope_rmse_deg", "slope error"),
        ("mass_rmse_kg", "mass error"),
    ];
    let mut wanted: Vec<(&str, &str)> = main
        .into_iter()
        .filter(|(metric, _)| metrics.iter().any(|m| m == metric))
        .collect();
    if wanted.is_empty() {
        let mut errors = metrics.iter().filter(|m| quantity(m).is_some());
        wanted.extend(errors.next().map(|m| (m.as_str(), m.as_str())));
    }
    let about = |metric: &str, what: &str| {
        let ratios = others
            .iter()
            .filter_map(|e| Some((e.as_str(), ErrorRatio::of(runs, e, metric)?)));
        let ratios: Vec<(&str, ErrorRatio)> = ratios.collect();
        let ranked = ratios.iter().filter(|(_, r)| r.share >= RANKED_SHARE);
        let least = ranked.min_by(|(_, a), (_, b)| a.ratio.total_cmp(&b.ratio));
        let (name, of) = least.or(match ratios.as_slice() {
            [one] => Some(one),
            _ => None,
        })?;
        let same = format!(
            "on the same samples ({:.0} % of all{})",
            100.0 * of.share,
            match of.interval {
                Some(_) => "",
                None => ", one run",
            }
        );
        let told = match of.interval {
            Some(i) if i.low <= 1.0 && i.high >= 1.0 => ": the runs show no difference",
            _ => "",
        };
        Some(match ratios.len() {
            1 => format!(
                "`{name}` has {} times the {what} of `{reference}` {same}{told}.",
                of.words()
            ),
            _ if of.is_less() => format!(
                "Least {what}: `{name}`, {} times the {what} of `{reference}` {same}.",
                of.words()
            ),
            _ => format!(
                "No other estimator has a smaller {what} than `{reference}`: the next, `{name}`, has {} times as much {same}{told}.",
                of.words()
            ),
        })
    };
    let all: Vec<String> = wanted
        .into_iter()
        .filter_map(|(metric, what)| about(metric, what))
        .collect();
    match (all.is_empty(), others.is_empty()) {
        (true, true) => vec![format!(
            "Only `{reference}` was run: no other estimator can be compared."
        )],
        (true, false) => vec![format!(
            "No estimator has valid samples in common with `{reference}`: no error was compared."
        )],
        _ => all,
    }
}

/// Metrics that are compared by default; metrics over the bound only if a run has a bound.
pub fn usual_metrics(runs: &[RunResult]) -> Vec<String> {
    let summaries = runs.iter().filter_map(|run| run.summary.as_ref());
    let mut values = summaries.flat_map(|s| s.estimators.values());
    let bounded = values.any(|of| {
        let measured = |name: &&str| of.get(*name).copied().flatten().is_some();
        OVER_BOUND.iter().any(measured)
    });
    let over = OVER_BOUND.iter().filter(|_| bounded);
    let all = USUAL_METRICS.iter().chain(over);
    all.map(|name| (*name).to_owned()).collect()
}

/// Every metric of every estimator over the runs, metrics outermost.
pub fn compare(
    runs: &[RunResult],
    estimators: &[String],
    metrics: &[String],
    reference: &str,
    published: &[Published],
) -> Vec<ComparedMetric> {
    let mut cells = Vec::new();
    for metric in metrics {
        for estimator in estimators {
            let all = values(runs, estimator, metric);
            let measured: Vec<f64> = all.iter().flatten().copied().collect();
            let differences: Vec<f64> = differences(runs, estimator, metric, reference)
                .into_iter()
                .flatten()
                .collect();
            cells.push(ComparedMetric {
                estimator: estimator.clone(),
                metric: metric.clone(),
                measured: measured.len(),
                runs: runs.len(),
                mean: Interval::bootstrap(&measured),
                median: median(&measured),
                valid: quantity(metric).map(|q| {
                    let own = values(runs, estimator, &format!("{metric}{VALID}"));
                    OnSamples::new(&own, &values(runs, estimator, mark(q, Marks::Availability)))
                }),
                common: quantity(metric)
                    .filter(|_| estimator != reference)
                    .map(|q| {
                        let [own, _] = common(runs, estimator, metric);
                        let shares = |run: &RunResult| {
                            let summary = run.whole()?;
                            summary.common.get(estimator)?.share.get(&q).copied()
                        };
                        OnSamples::new(&own, &runs.iter().map(shares).collect::<Vec<_>>())
                    }),
                difference: (estimator != reference)
                    .then(|| Interval::bootstrap(&differences))
                    .flatten(),
                published: published
                    .iter()
                    .find(|p| p.estimator == *estimator && p.metric == *metric)
                    .cloned(),
            });
        }
    }
    cells
}

/// Quantity whose error over all samples is the metric; `None` if the metric is not such an error.
fn quantity(metric: &str) -> Option<Quantity> {
    find(metric).filter(|m| !m.is_of_valid())?.error_of()
}

/// Estimator minus reference run by run: of an error on the samples that both mark valid, of another metric as it
/// stands; none where one of the two could not be measured.
pub(crate) fn differences(
    runs: &[RunResult],
    estimator: &str,
    metric: &str,
    reference: &str,
) -> Vec<Option<f64>> {
    let base = metric.strip_suffix(VALID).unwrap_or(metric);
    let [own, theirs] = match quantity(base) {
        Some(_) => common(runs, estimator, base),
        None => [
            values(runs, estimator, metric),
            values(runs, reference, metric),
        ],
    };
    let pairs = own.into_iter().zip(theirs);
    pairs.map(|(a, b)| Some(a? - b?)).collect()
}

/// An error run by run on the samples that the estimator and the reference both mark valid: the estimator's and the
/// reference's.
fn common(runs: &[RunResult], estimator: &str, metric: &str) -> [Vec<Option<f64>>; 2] {
    let of = |i: usize| {
        let value = move |run: &RunResult| {
            let summary = run.whole()?;
            summary.common.get(estimator)?.errors.get(metric)?[i]
        };
        runs.iter().map(value).collect()
    };
    [of(0), of(1)]
}

/// A metric of an estimator run by run; `None` if the run did not finish or the metric could not be measured.
pub(crate) fn values(runs: &[RunResult], estimator: &str, metric: &str) -> Vec<Option<f64>> {
    let value = |run: &RunResult| {
        let summary = run.whole()?;
        summary.estimators.get(estimator)?.get(metric).copied()?
    };
    runs.iter().map(value).collect()
}

fn median(x: &[f64]) -> Option<f64> {
    let mut x = x.to_vec();
    x.sort_unstable_by(f64::total_cmp);
    let (low, high) = (x.get(x.len().checked_sub(1)? / 2)?, x.get(x.len() / 2)?);
    Some(0.5 * (low + high))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::verdicts::common::CommonErrors;
    use crate::verdicts::summary::Summary;

    #[test]
    fn medians() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(median(&[]), None);
    }

    /// Two estimators that share no valid sample have no difference, however their errors compare on their own samples.
    #[test]
    fn differences_of_errors_are_taken_on_common_samples_only() {
        let run = |seed: u64, common: Option<[f64; 2]>| {
            let own = |all: f64, valid: f64| {
                let metrics = [
                    ("slope_rmse_deg", all),
                    ("slope_rmse_deg_valid", valid),
                    ("slope_availability", 0.5),
                ];
                metrics
                    .map(|(m, x)| (m.to_owned(), Some(x)))
                    .into_iter()
                    .collect()
            };
            let errors = CommonErrors {
                share: [(Quantity::Slope, if common.is_some() { 0.25 } else { 0.0 })].into(),
                errors: [(
                    "slope_rmse_deg".to_owned(),
                    common.map_or([None; 2], |c| c.map(Some)),
                )]
                .into(),
            };
            RunResult {
                index: seed,
                scenario: "hill".into(),
                seed,
                draws: BTreeMap::new(),
                error: None,
                summary: Some(Summary {
                    version: 1,
                    scenario: "hill".into(),
                    seed,
                    finished: true,
                    never_valid: Vec::new(),
                    simulated_s: 60.0,
                    steps: 1,
                    after_s: 5.0,
                    estimators: [("a".into(), own(3.0, 0.1)), ("b".into(), own(4.0, 0.2))].into(),
                    run: BTreeMap::new(),
                    refusals: Vec::new(),
                    expectations: Vec::new(),
                    limits: Default::default(),
                    integrity: Vec::new(),
                    weakened: Vec::new(),
                    common: [("b".into(), errors)].into(),
                }),
            }
        };
        let table = |runs: &[RunResult]| {
            let names = ["a".to_owned(), "b".to_owned()];
            compare(runs, &names, &["slope_rmse_deg".into()], "a", &[])
        };
        let shared = table(&[
            run(1, Some([0.3, 0.1])),
            run(2, Some([0.5, 0.1])),
            run(3, None),
        ]);
        let [a, b] = &shared[..] else {
            panic!("{shared:?}")
        };
        assert_eq!(
            (a.mean.map(|i| i.mean), a.common.as_ref(), a.difference),
            (Some(3.0), None, None)
        );
        assert_eq!(a.valid.as_ref().and_then(|v| v.median), Some(0.1));
        let on_common = b.common.as_ref().unwrap();
        assert_eq!((on_common.measured, on_common.median), (2, Some(0.4)));
        assert!((on_common.share.unwrap() - 0.5 / 3.0).abs() < 1e-12);
        let difference = b.difference.unwrap();
        assert!((difference.mean - 0.3).abs() < 1e-12 && difference.n == 2);
        let apart = table(&[run(1, None), run(2, None)]);
        assert!(apart[1].difference.is_none() && apart[1].mean.is_some());
    }
}
