//! One scenario over its seeds: checks, metrics, distributions.

use super::values::{Values, estimators, with_unit};
use crate::metrics::{METRICS, RUN_METRICS};
use crate::report::page::Section;
use crate::report::plot::axis::Axis;
use crate::report::plot::boxes::Boxes;
use crate::report::plot::theme::Ink;
use crate::report::plot::{Figure, Group};
use crate::report::table::{Cell, Table};
use crate::study::RunResult;
use crate::summary::MAIN;
use crate::verdict::{Check, Judged};

/// The section of a scenario.
pub fn section(scenario: &Judged) -> Section {
    let runs = &scenario.runs;
    let mut section = Section::new(&scenario.scenario).table(checks(&scenario.checks));
    if runs.len() > 1 {
        let shown = METRICS.iter().filter(|m| MAIN.contains(&m.name));
        section = section.figures(shown.map(|m| distribution(runs, m.name, m.unit)));
    }
    section.table(metrics(runs))
}

fn checks(checks: &[Check]) -> Table {
    let mut table = Table::new(&["", "check", "bound", "worst seed"], &["seeds that hold"]);
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
fn metrics(runs: &[RunResult]) -> Table {
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
    table.caption = "Metrics over the seeds".into();
    let mut add = |owner: &str, name: String, values: Values| {
        let (low, high) = values.interval();
        let interval = match low.is_finite() {
            true => Cell::from(format!(
                "{} … {}",
                Cell::number(low).text,
                Cell::number(high).text
            )),
            false => Cell::from("–"),
        };
        table.row([
            owner.into(),
            name.into(),
            Cell::number(values.mean()),
            interval,
            Cell::number(values.quantile(0.5)),
            Cell::number(values.quantile(0.0)),
            Cell::number(values.quantile(1.0)),
            format!("{} of {}", values.measured.len(), values.runs).into(),
        ]);
    };
    for name in estimators(runs) {
        for metric in METRICS {
            let values = Values::of(runs, Some(&name), metric.name);
            add(&name, with_unit(metric.name, metric.unit), values);
        }
    }
    for (metric, unit, _) in RUN_METRICS {
        add(
            "train",
            with_unit(metric, unit),
            Values::of(runs, None, metric),
        );
    }
    table
}
