//! What was expected, whether it held, and the figures that say most.

use crate::html::number;
use crate::metrics::{estimator_metrics, run_metrics};
use crate::report::page::Section;
use crate::report::table::{Cell, Table};
use crate::verdicts::summary::{MAIN, Summary};

/// The outcome in a sentence.
pub fn banner(summary: &Summary) -> (String, bool) {
    let all = summary.expectations.len();
    let failed = summary.expectations.iter().filter(|v| !v.held).count();
    let t = summary.simulated_s;
    if !summary.finished {
        return (
            format!("NOT finished: the run was stopped after {t:.1} s"),
            false,
        );
    }
    match (all, failed) {
        (0, _) => (
            format!("Finished after {t:.1} s; nothing was expected of this run"),
            true,
        ),
        (1, 0) => ("The one expectation held".into(), true),
        (_, 0) => (format!("All {all} expectations held"), true),
        _ => (format!("{failed} of {all} expectations FAILED"), false),
    }
}

/// Verdicts and key figures.
pub fn section(summary: &Summary) -> Section {
    let mut section = Section::new("Verdicts and key figures");
    if !summary.expectations.is_empty() {
        section = section.table(verdicts(summary));
    }
    for (name, times, reason) in &summary.refusals {
        section = section.text(format!(
            "{name} refused {times} steps, the first because {reason}."
        ));
    }
    for name in &summary.never_valid {
        section = section.text(format!("{name} had no valid estimate in the whole run."));
    }
    if !summary.estimators.is_empty() {
        section = section.table(key_figures(summary));
    }
    section.table(of_the_run(summary))
}

fn verdicts(summary: &Summary) -> Table {
    let mut table = Table::new(&["", "expected"], &["bound", "measured"]);
    for v in &summary.expectations {
        let value = v.value.map_or("not measured".to_owned(), number);
        let verdict = Cell::from(if v.held { "held" } else { "FAILED" });
        table.row([
            verdict.judged(v.held),
            v.what().into(),
            v.bound().into(),
            value.into(),
        ]);
    }
    table
}

fn key_figures(summary: &Summary) -> Table {
    let mut table = Table::new(&["estimator"], &[]);
    table.caption = format!(
        "Estimators, from {} s on, where they mark their values valid",
        summary.after_s
    );
    let shown = estimator_metrics().filter(|m| MAIN.contains(&m.name));
    for metric in shown.clone() {
        table.columns.push((metric.name.to_owned(), true));
    }
    for (name, values) in &summary.estimators {
        let numbers = shown.clone().map(|m| {
            let value = values.get(m.name).copied().flatten();
            Cell::number(value.unwrap_or(f64::NAN))
        });
        table.row(std::iter::once(name.clone().into()).chain(numbers));
    }
    table
}

fn of_the_run(summary: &Summary) -> Table {
    let mut table = Table::new(&["vehicle and controller", ""], &["value"]);
    for metric in run_metrics() {
        let value = summary.run.get(metric.name).copied().flatten();
        table.row([
            metric.name.into(),
            metric.doc.into(),
            Cell::number(value.unwrap_or(f64::NAN)),
        ]);
    }
    table
}

/// Every metric of every estimator.
pub fn all_metrics(summary: &Summary) -> Table {
    let mut table = Table::new(&["metric"], &[]);
    table.caption = "All metrics of the estimators".into();
    for name in summary.estimators.keys() {
        table.columns.push((name.clone(), true));
    }
    for metric in estimator_metrics() {
        let values = summary.estimators.values().map(|values| {
            let value = values.get(metric.name).copied().flatten();
            Cell::number(value.unwrap_or(f64::NAN))
        });
        let name = metric.name.into();
        table.row(std::iter::once(name).chain(values));
    }
    table
}
