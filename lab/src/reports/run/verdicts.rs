//! Expectations with their verdicts, and the main figures.

use crate::metrics::{Metric, VALID, estimator_metrics, run_metrics, told_sd};
use crate::reports::findings;
use crate::reports::page::Section;
use crate::reports::table::{Cell, Table};
use crate::text::number;
use crate::verdicts::findings::of_summaries;
use crate::verdicts::judgement::Grade;
use crate::verdicts::summary::{MAIN, Summary};
use std::collections::BTreeMap;

/// The outcome in a sentence.
pub(crate) fn banner(summary: &Summary) -> (String, Grade) {
    let judged = summary.verdict().judgement();
    let mut text = judged.words();
    if !summary.finished {
        let t = summary.simulated_s;
        text = format!("{text}; NOT finished: the run was stopped after {t:.1} s");
    }
    if let Some(more) = findings::told(&of_summaries([summary])) {
        text += &format!("; {more}");
    }
    (text, judged.grade())
}

/// Table of misleading estimates, worst first; `None` without any.
pub(crate) fn findings(summary: &Summary) -> Option<Section> {
    findings::of_one(of_summaries([summary]))
}

/// Verdicts and key figures.
pub(crate) fn section(summary: &Summary, replayed: bool) -> Section {
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
    let verdict = summary.verdict();
    for check in verdict.checks.iter().filter(|c| c.not_judged) {
        section = section.text(format!("Not judged: {}.", check.reason()));
    }
    if !verdict.weakened.is_empty() {
        section = section.text(format!("Weakened limits: {}.", verdict.weakened.join("; ")));
    }
    if !summary.estimators.is_empty() {
        section = section.table(key_figures(summary));
    }
    // of a log nobody drove by a reference speed
    match replayed {
        true => section,
        false => section.table(of_the_run(summary)),
    }
}

fn verdicts(summary: &Summary) -> Table {
    let mut table = Table::new(&["", "expected"], &["bound", "measured"]);
    for v in &summary.expectations {
        let value = v.value.map_or("not measured".to_owned(), number);
        let verdict = match v.word() {
            "known failure" => Cell::from("known failure"),
            word => Cell::from(word).judged(v.held),
        };
        let what = match &v.known_failure {
            Some(why) => format!("{} ({why})", v.what()),
            None => v.what(),
        };
        table.row([verdict, what.into(), v.bound().into(), value.into()]);
    }
    table
}

/// The value of a metric, a dash where it was not measured.
fn of_metric(values: &BTreeMap<String, Option<f64>>, metric: &Metric) -> Cell {
    Cell::number(values.get(metric.name).copied().flatten())
}

fn key_figures(summary: &Summary) -> Table {
    let mut table = Table::new(&["estimator"], &[]);
    table.caption = format!(
        "Estimators, from {} s on: errors ± 2 told standard deviations, of all samples and `…_valid` of those marked valid",
        summary.after_s
    );
    let shown = estimator_metrics().filter(|m| MAIN.contains(&m.name));
    for metric in shown.clone() {
        table.columns.push((metric.name.to_owned(), true));
    }
    for (name, values) in &summary.estimators {
        let numbers = shown.clone().map(|m| with_told(values, m));
        table.row(std::iter::once(name.clone().into()).chain(numbers));
    }
    table
}

/// The value of a metric; of an error with twice the standard deviation that was told beside it.
fn with_told(values: &BTreeMap<String, Option<f64>>, metric: &Metric) -> Cell {
    let of = |name: &str| values.get(name).copied().flatten();
    let sd = told_sd(metric.name).and_then(|sd| match metric.is_of_valid() {
        true => of(&format!("{sd}{VALID}")),
        false => of(sd),
    });
    match of(metric.name).zip(sd) {
        Some((error, sd)) => format!("{} ± {}", number(error), number(2.0 * sd)).into(),
        None => of_metric(values, metric),
    }
}

fn of_the_run(summary: &Summary) -> Table {
    let mut table = Table::new(&["vehicle and controller", ""], &["value"]);
    for metric in run_metrics() {
        let value = of_metric(&summary.run, metric);
        table.row([metric.name.into(), metric.doc.into(), value]);
    }
    table
}

/// Every metric of every estimator.
pub(crate) fn all_metrics(summary: &Summary) -> Table {
    let mut table = Table::new(&["metric"], &[]);
    table.caption = "All metrics of the estimators".into();
    for name in summary.estimators.keys() {
        table.columns.push((name.clone(), true));
    }
    for metric in estimator_metrics() {
        let values = summary.estimators.values();
        let values = values.map(|values| of_metric(values, metric));
        table.row(std::iter::once(metric.name.into()).chain(values));
    }
    table
}
