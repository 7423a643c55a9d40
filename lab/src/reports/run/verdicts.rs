//! Expectations with their verdicts, and the main figures.

use crate::metrics::{Metric, estimator_metrics, run_metrics};
use crate::reports::findings;
use crate::reports::page::Section;
use crate::reports::table::{Cell, Table};
use crate::text::number;
use crate::verdicts::findings::of_summaries;
use crate::verdicts::judgement::Grade;
use crate::verdicts::overview;
use crate::verdicts::summary::Summary;
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

/// The checks that failed, with their reasons, and misleading estimates; `None` if all held.
pub(crate) fn failed(summary: &Summary) -> Option<Section> {
    let verdict = summary.verdict();
    let mut table = Table::new(&["", "reason"], &[]);
    for check in verdict.checks.iter().filter(|c| !c.held) {
        table.row([Cell::from("FAILED").judged(false), check.reason().into()]);
    }
    (!table.rows.is_empty()).then(|| Section::new("What failed").table(table))
}

/// Misleading estimates, worst first, with findings about baselines folded; `None` without misleading estimates.
pub(crate) fn findings(summary: &Summary) -> Option<Section> {
    findings::of_one(of_summaries([summary]))
}

/// The table of the terminal.
pub(crate) fn overview<'a>(
    summary: &Summary,
    names: impl Iterator<Item = &'a str>,
    in_loop: Option<&str>,
) -> Option<Section> {
    let titles = overview::OVERVIEW_TITLES.map(|title| title.replace('\n', " "));
    let titles = titles.each_ref().map(|title| title.trim());
    let mut table = Table::new(&titles[..1], &titles[1..5]);
    table.columns.push((titles[5].to_owned(), false));
    for row in overview::rows(summary, names, in_loop) {
        table.row(row.map(Cell::from));
    }
    let legend = overview::legend(summary, in_loop);
    let about = format!("From {} s on. {legend}", summary.after_s);
    (!table.rows.is_empty()).then(|| Section::new("Estimators").table(table).text(about))
}

/// Verdicts, and the figures of the run.
pub(crate) fn section(summary: &Summary, replayed: bool) -> Section {
    let mut section = Section::new("Verdicts");
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

/// The value of a metric, or a dash if it was not measured.
fn of_metric(values: &BTreeMap<String, Option<f64>>, metric: &Metric) -> Cell {
    Cell::number(values.get(metric.name).copied().flatten())
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
