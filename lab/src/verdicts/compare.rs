//! Estimators against each other on the same runs: means with confidence intervals, paired differences, published figures.

use crate::batch::RunResult;
use crate::verdicts::interval::Interval;
use monorig_sim::config::scenario::{Published, Settings};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One metric of one estimator over all runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ComparedMetric {
    /// Estimator.
    pub estimator: String,
    /// Metric.
    pub metric: String,
    /// Runs in which it could be measured.
    pub measured: usize,
    /// All runs.
    pub runs: usize,
    /// Mean over these; none with fewer than two.
    pub mean: Option<Interval>,
    /// Median over these.
    pub median: Option<f64>,
    /// Mean of estimator minus reference, run by run, over the runs in which both could be measured; none for the reference.
    pub difference: Option<Interval>,
    /// What was published for it.
    pub published: Option<Published>,
}

/// Estimators compared: what `monorig compare --json` writes.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Comparison {
    /// Format version, 1.
    pub version: u32,
    /// What this file is: `compare`.
    pub kind: String,
    /// Version of monorig.
    pub monorig: String,
    /// Scenario.
    pub scenario: String,
    /// The estimators of the runs with their types and parameters.
    #[serde(default)]
    pub estimators: BTreeMap<String, Settings>,
    /// Estimator that the others are held against.
    pub reference: String,
    /// Every metric of every estimator, metrics outermost.
    pub table: Vec<ComparedMetric>,
    /// The runs, one for each seed.
    pub runs: Vec<RunResult>,
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
        let reference_values = values(runs, reference, metric);
        for estimator in estimators {
            let all = values(runs, estimator, metric);
            let measured: Vec<f64> = all.iter().flatten().copied().collect();
            let pairs = all.iter().zip(&reference_values);
            let differences: Vec<f64> = pairs.filter_map(|(a, b)| Some((*a)? - (*b)?)).collect();
            cells.push(ComparedMetric {
                estimator: estimator.clone(),
                metric: metric.clone(),
                measured: measured.len(),
                runs: runs.len(),
                mean: Interval::bootstrap(&measured),
                median: median(&measured),
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

/// A metric of an estimator run by run; none where the run did not finish or it could not be measured.
pub fn values(runs: &[RunResult], estimator: &str, metric: &str) -> Vec<Option<f64>> {
    let value = |run: &RunResult| {
        let summary = run.summary.as_ref().filter(|s| s.finished)?;
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

    #[test]
    fn medians() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(median(&[]), None);
    }
}
