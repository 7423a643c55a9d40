//! A scenario over many runs: checks, metrics, distributions.

use super::paired;
use super::values::{Values, estimators};
use crate::metrics::{METRICS, RUN_METRICS};
use crate::report::html::with_unit;
use crate::report::page::Section;
use crate::report::plot::axis::Axis;
use crate::report::plot::boxes::Boxes;
use crate::report::plot::theme::Ink;
use crate::report::plot::{Figure, Group};
use crate::report::table::{Cell, Table};
use crate::study::RunResult;
use crate::summary::MAIN;
use crate::verdict::Check;

/// What was asked of the runs.
pub fn verdicts(section: Section, all: &[Check]) -> Section {
    section.table(checks(all))
}

/// Metrics over the runs: distributions, differences, and all numbers.
pub fn metrics(section: Section, runs: &[RunResult]) -> Section {
    if runs.len() < 2 {
        return section.table(numbers(runs));
    }
    let shown = METRICS.iter().filter(|m| MAIN.contains(&m.name));
    let section = section.figures(shown.map(|m| distribution(runs, m.name, m.unit)));
    let section = match paired::differences(runs) {
        Some(table) => section.table(table),
        None => section,
    };
    section.table(numbers(runs))
}

fn checks(checks: &[Check]) -> Table {
    let mut table = Table::new(&["", "check", "bound", "worst run"], &["runs that hold"]);
    for check in checks {
        let all = check.holding + check.failing.len();
        let verdict = Cell::from(if check.held { "held" } else { "FAILED" });
        table.row([
            verdict.judged(check.held),
            check.what.clone().into(),
            check.bound.clone().into(),
            check.worst.clone().unwrap_or_default().into(),
            format!("{} of {all}", check.holding).into(),
        ]);
    }
    table
}

fn distribution(runs: &[RunResult], metric: &str, unit: &str) -> Figure {
    let groups = estimators(runs).into_iter().enumerate();
    let groups = groups.map(|(i, name)| {
        let values = Values::of(runs, Some(&name), metric).measured;
        Group::new(name, Ink::series(i), values)
    });
    Boxes {
        title: metric.to_owned(),
        y: Axis::linear(with_unit(metric, unit)),
        groups: groups.filter(|g| !g.values.is_empty()).collect(),
        references: Vec::new(),
    }
    .figure()
}

/// Every metric of every estimator and of the run over the seeds.
pub fn numbers(runs: &[RunResult]) -> Table {
    let mut table = Table::new(
        &["", "metric"],
        &[
            "mean",
            "95 % interval of the mean",
            "median",
            "least",
            "greatest",
            "measured",
        ],
    );
    table.caption = "Metrics over the runs".into();
    let mut add = |owner: &str, name: String, values: Values| {
        table.row([
            owner.into(),
            name.into(),
            Cell::number(values.mean()),
            values.interval_text().into(),
            Cell::number(values.quantile(0.5)),
            Cell::number(values.quantile(0.0)),
            Cell::number(values.quantile(1.0)),
            format!("{} of {}", values.measured.len(), values.runs).into(),
        ]);
    };
    for name in estimators(runs) {
        for metric in METRICS {
            let values = Values::of(runs, Some(&name), metric.name);
            add(&name, metric.name.to_owned(), values);
        }
    }
    for metric in RUN_METRICS {
        let values = Values::of(runs, None, metric.name);
        add("train", metric.name.to_owned(), values);
    }
    table
}
