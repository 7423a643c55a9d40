//! Differences between estimators over the same runs: what is common to both, noise and draws, cancels. Errors are of
//! all samples: each estimator's own valid ones may be of different stretches.

use crate::metrics::{Metric, estimator_metrics, find};
use crate::reports::study::values::{MetricValues, estimators, value};
use crate::reports::table::{Cell, Table};
use crate::verdicts::interval::effect_size;
use crate::verdicts::run_result::RunResult;
use crate::verdicts::summary::MAIN;

/// Every other estimator minus the first one; none if there is only one.
pub(crate) fn differences(runs: &[RunResult]) -> Option<Table> {
    let names = estimators(runs);
    let (reference, others) = names.split_first()?;
    if others.is_empty() {
        return None;
    }
    let mut table = Table::new(
        &["", "metric"],
        &[
            "mean difference",
            "95 % interval",
            "effect size",
            "of the runs, larger in",
            "runs",
        ],
    );
    table.caption = format!(
        "Differences to {reference} over the runs in which both were measured; coloured where zero is not in the interval. Effect \
         size: mean over standard deviation of the differences (Cohen's d: 0.2 small, 0.5 medium, 0.8 large)"
    );
    for name in others {
        let shown = |m: &&Metric| MAIN.contains(&m.name) && !m.is_of_valid();
        for metric in estimator_metrics().filter(shown) {
            let of = |run, name| value(run, Some(name), metric.name);
            let both = runs.iter();
            let both = both.filter_map(|run| Some(of(run, name)? - of(run, reference)?));
            let all = MetricValues::new(runs.len(), both.collect());
            let n = all.measured.len();
            if n == 0 {
                continue;
            }
            let (low, high) = all.interval();
            let mean = difference(metric.name, all.mean(), low, high);
            let larger = all.measured.iter().filter(|d| **d > 0.0).count();
            table.row([
                name.clone().into(),
                metric.name.into(),
                mean,
                all.interval_text().into(),
                Cell::number(effect_size(&all.measured)),
                format!("{:.0} %", 100.0 * larger as f64 / n as f64).into(),
                n.to_string().into(),
            ]);
        }
    }
    Some(table)
}

/// A mean difference of a metric, judged where zero is not in its interval.
pub(crate) fn difference(metric: &str, mean: f64, low: f64, high: f64) -> Cell {
    let cell = Cell::number(mean);
    let less = match (low > 0.0, high < 0.0) {
        (true, _) => Some(false),
        (_, true) => Some(true),
        _ => None,
    };
    match less.zip(find(metric).and_then(|m| m.best.less_is_better())) {
        Some((less, less_is_better)) => cell.judged(less == less_is_better),
        None => cell,
    }
}
