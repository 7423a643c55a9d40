//! A scenario over many runs: checks, metrics, distributions.

use crate::metrics::{estimator_metrics, run_metrics};
use crate::reports::findings;
use crate::reports::page::Section;
use crate::reports::plot::axis::Axis;
use crate::reports::plot::boxes::Boxes;
use crate::reports::plot::theme::Ink;
use crate::reports::plot::{Figure, ValueGroup};
use crate::reports::study::expected;
use crate::reports::study::values::{MetricValues, estimators, is_main};
use crate::reports::table::{Cell, Table};
use crate::text::with_unit;
use crate::verdicts::run_result::RunResult;
use crate::verdicts::summary::MAIN;
use crate::verdicts::verdict::Check;

/// The checks of the runs, with values where there are several runs.
pub(crate) fn verdicts(section: Section, all: &[Check], runs: &[RunResult]) -> Section {
    let section = section.table(checks(all));
    match runs.len() {
        0 | 1 => section,
        _ => section.figures(expected::figures(runs)),
    }
}

/// Availability and integrity of the estimators over the runs.
pub(crate) fn integrity(section: Section, runs: &[RunResult]) -> Section {
    section.table(findings::integrity(
        runs.iter().filter_map(|r| r.summary.as_ref()),
    ))
}

/// Metrics over the runs: distributions, and all numbers.
pub(crate) fn metrics(section: Section, runs: &[RunResult]) -> Section {
    if runs.len() < 2 {
        return numbers(section, runs);
    }
    let shown = estimator_metrics().filter(|m| MAIN.contains(&m.name));
    let section = section.figures(shown.map(|m| distribution(runs, m.name, m.unit)));
    numbers(section, runs)
}

fn checks(checks: &[Check]) -> Table {
    let mut table = Table::new(&["", "check", "bound", "worst run"], &["runs that hold"]);
    for check in checks {
        let all = check.holding + check.failing.len();
        let verdict = match (check.held, check.fails_as_known()) {
            (_, true) => Cell::from("known failure"),
            _ if check.not_judged => Cell::from("not judged"),
            (held, _) => Cell::from(if held { "held" } else { "FAILED" }).judged(held),
        };
        let worst = match &check.known_failure {
            Some(_) if !check.held => check.reason(),
            Some(why) => format!("{} ({why})", check.worst.clone().unwrap_or_default()),
            None => check.worst.clone().unwrap_or_default(),
        };
        table.row([
            verdict,
            check.what.clone().into(),
            check.bound.clone().into(),
            worst.into(),
            format!("{} of {all}", check.holding).into(),
        ]);
    }
    table
}

fn distribution(runs: &[RunResult], metric: &str, unit: &str) -> Figure {
    let groups = estimators(runs).into_iter().map(|name| {
        let values = MetricValues::of(runs, Some(&name), metric).measured;
        let (ink, main) = (Ink::of_estimator(&name), is_main(runs, &name));
        ValueGroup::new(name, ink, values).aside(!main)
    });
    let y = Axis::linear(with_unit(metric, unit));
    let groups = groups.filter(|g| !g.values.is_empty());
    Boxes::new(metric, y, groups).figure()
}

/// Every metric of every estimator and of the run over the seeds, a table each.
pub(crate) fn numbers(mut section: Section, runs: &[RunResult]) -> Section {
    for name in estimators(runs) {
        let metrics = estimator_metrics().map(|m| (m.name, m.unit));
        let table = over_runs(runs, Some(&name), metrics);
        section = section.folded(format!("Every metric of {name}"), table);
    }
    let metrics = run_metrics().map(|m| (m.name, m.unit));
    section.folded(
        "Every metric of vehicle and controller",
        over_runs(runs, None, metrics),
    )
}

fn over_runs<'a>(
    runs: &[RunResult],
    estimator: Option<&str>,
    metrics: impl Iterator<Item = (&'a str, &'a str)>,
) -> Table {
    let titles = [
        "mean",
        "95 % interval of the mean",
        "median",
        "least",
        "greatest",
        "measured",
    ];
    let mut table = Table::new(&["metric"], &titles);
    for (metric, unit) in metrics {
        let values = MetricValues::of(runs, estimator, metric);
        table.row([
            with_unit(metric, unit).into(),
            Cell::number(values.mean()),
            values.interval_text().into(),
            Cell::number(values.quantile(0.5)),
            Cell::number(values.quantile(0.0)),
            Cell::number(values.quantile(1.0)),
            format!("{} of {}", values.measured.len(), values.runs).into(),
        ]);
    }
    table
}
