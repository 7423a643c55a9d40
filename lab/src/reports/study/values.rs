//! A metric over runs: its values and their statistics.

use crate::reports::plot::boxes::quantile;
use crate::text::number;
use crate::verdicts::interval::Interval;
use crate::verdicts::run_result::RunResult;
use std::collections::BTreeSet;

/// A metric over runs, in ascending order.
pub(crate) struct MetricValues {
    /// Number of runs.
    pub(crate) runs: usize,
    /// Values of the runs in which the metric could be measured.
    pub(crate) measured: Vec<f64>,
}

impl MetricValues {
    /// A metric of an estimator, or of the run.
    pub(crate) fn of(runs: &[RunResult], estimator: Option<&str>, metric: &str) -> Self {
        let values = runs.iter().filter_map(|run| value(run, estimator, metric));
        Self::new(runs.len(), values.collect())
    }

    /// Makes the values from a list in any order, and the number of runs.
    pub(crate) fn new(runs: usize, mut measured: Vec<f64>) -> Self {
        measured.sort_unstable_by(f64::total_cmp);
        Self { runs, measured }
    }

    /// Mean; NaN without values.
    pub(crate) fn mean(&self) -> f64 {
        self.measured.iter().sum::<f64>() / self.measured.len() as f64
    }

    pub(crate) fn quantile(&self, p: f64) -> f64 {
        quantile(&self.measured, p)
    }

    /// 95 % confidence interval of the mean by Student's t; infinite for a single value.
    pub(crate) fn interval(&self) -> (f64, f64) {
        let i = Interval::student(&self.measured);
        (i.low, i.high)
    }

    /// Describes it in words.
    pub(crate) fn interval_text(&self) -> String {
        let (low, high) = self.interval();
        match low.is_finite() {
            true => format!("{} … {}", number(low), number(high)),
            false => number(f64::NAN),
        }
    }
}

/// A metric of an estimator, or of the run, in one run; `None` if it could not be measured.
pub(crate) fn value(run: &RunResult, estimator: Option<&str>, metric: &str) -> Option<f64> {
    let summary = run.summary.as_ref()?;
    let all = match estimator {
        Some(name) => summary.estimators.get(name)?,
        None => &summary.run,
    };
    let value = all.get(metric).copied().flatten();
    value.filter(|x| x.is_finite())
}

/// True for an estimator that the axes must show: one that is judged; all are, if none is judged.
pub(crate) fn is_main(runs: &[RunResult], estimator: &str) -> bool {
    let mut summaries = runs.iter().filter_map(|r| r.summary.as_ref());
    summaries.next().is_none_or(|s| s.is_main(estimator))
}

/// Estimators of these runs.
pub(crate) fn estimators(runs: &[RunResult]) -> Vec<String> {
    let names = runs.iter().filter_map(|r| r.summary.as_ref());
    let names: BTreeSet<&String> = names.flat_map(|s| s.estimators.keys()).collect();
    names.into_iter().cloned().collect()
}
