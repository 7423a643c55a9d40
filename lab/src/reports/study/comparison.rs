//! The report of a comparison: estimators on the same runs, beside each other and beside what was published.

use crate::metrics;
use crate::reports::findings as report_findings;
use crate::reports::page::{Page, Section};
use crate::reports::parameters;
use crate::reports::plot::axis::Axis;
use crate::reports::plot::boxes::Boxes;
use crate::reports::plot::theme::Ink;
use crate::reports::plot::{Figure, ValueGroup};
use crate::reports::study::runs;
use crate::reports::study::values::is_main;
use crate::reports::table::{Cell, Table};
use crate::text::{number, with_unit};
use crate::verdicts::compare::{
    ComparedMetric, Comparison, OnSamples, differences as run_by_run, sentences, values,
};
use crate::verdicts::findings;
use crate::verdicts::interval::Interval;
use crate::verdicts::judgement::Grade;
use std::collections::BTreeSet;

/// Lay it out.
pub(crate) fn page(all: &Comparison) -> Page {
    let (runs, estimators) = (all.runs.len(), names(all, |c| &c.estimator));
    let mut page = Page::new(format!("Comparison on {}", all.scenario));
    page.subtitle = format!(
        "{} estimators on the same {runs} runs, one for each seed; reference: {}; monorig {}",
        estimators.len(),
        all.reference,
        all.monorig
    );
    let finished = all.runs.iter().filter(|r| r.finished()).count();
    let compared = sentences(
        &all.runs,
        &estimators
            .iter()
            .map(|e| (*e).to_owned())
            .collect::<Vec<_>>(),
        &names(all, |c| &c.metric)
            .iter()
            .map(|m| (*m).to_owned())
            .collect::<Vec<_>>(),
        &all.reference,
    );
    let compared = compared.join(" ").replace('`', "");
    page.banner = Some(match runs - finished {
        0 => (compared, Grade::Unasked),
        n => (
            format!("FAILED: {n} of {runs} runs did not finish and are left out. {compared}"),
            Grade::Failed,
        ),
    });
    let findings = findings::of_runs(&all.runs).into_iter();
    let findings: Vec<_> = findings.map(|f| (String::new(), f)).collect();
    page.sections.push(overview(all));
    page.sections.extend(report_findings::section(&findings));
    for metric in names(all, |c| &c.metric) {
        page.sections.push(section(all, metric));
    }
    if finished < runs {
        page.sections.push(left_out(all));
    }
    let section = Section::new("All metrics").text(
        "Metrics of all estimators, including those that are not compared. Intervals are after Student.",
    );
    page.sections.push(runs::numbers(section, &all.runs));
    page
}

/// Names in the order of the table, without repetition.
fn names<'a>(all: &'a Comparison, of: impl Fn(&'a ComparedMetric) -> &'a String) -> Vec<&'a str> {
    let mut names: Vec<&str> = Vec::new();
    for name in all.table.iter().map(of) {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    names
}

fn unit(metric: &str) -> &'static str {
    metrics::unit(metric).unwrap_or("1")
}

/// Means in one table, a row for each metric; below an error the share of valid samples and the published figure.
fn overview(all: &Comparison) -> Section {
    let estimators = names(all, |c| &c.estimator);
    let mut table = Table::new(&["mean over the runs, all samples"], &estimators);
    for metric in names(all, |c| &c.metric) {
        let of = |estimator: &str| {
            let mut of_both = all.table.iter();
            of_both.find(|c| c.estimator == estimator && c.metric == metric)
        };
        let mut row = |title: String, cell: &dyn Fn(&ComparedMetric) -> Cell| {
            let cells = estimators.iter();
            let cells = cells.map(|e| of(e).map_or(Cell::number(None), cell));
            table.row(std::iter::once(title.into()).chain(cells));
        };
        let any = |has: fn(&ComparedMetric) -> bool| {
            let mut of_metric = all.table.iter().filter(|c| c.metric == metric);
            of_metric.any(has)
        };
        row(with_unit(metric, unit(metric)), &|c| {
            Cell::number(c.mean.map(|i| i.mean))
        });
        if any(|c| c.valid.is_some()) {
            row("… valid".into(), &|c| {
                let [_, share] = on_samples(c.valid.as_ref());
                share
            });
        }
        if any(|c| c.published.is_some()) {
            row("… published".into(), &theirs);
        }
    }
    let sources: BTreeSet<&str> = all
        .table
        .iter()
        .filter_map(|c| Some(c.published.as_ref()?.source.as_str()))
        .collect();
    let section = Section::new("Overview").table(table);
    let section = section.table(parameters::table(&all.estimators)).text(
        "This table has the errors of all samples from 5 s on. Below, each metric has its own table: over all samples, \
         over samples that the estimator marks valid, and over samples that it and the reference both mark valid, with \
         their shares. Intervals are of the mean, by the percentile bootstrap over the runs. Differences are computed \
         run by run, for errors only on common samples, and are coloured if their interval does not contain zero.",
    );
    if sources.is_empty() {
        return section.text("No figures were published for these estimators on this scenario.");
    }
    let sources: Vec<&str> = sources.into_iter().collect();
    section.text(format!("Published: {}.", sources.join("; ")))
}

fn theirs(c: &ComparedMetric) -> Cell {
    Cell::number(c.published.as_ref().map(|p| p.value.get()))
}

/// One metric: table, distribution over the runs, differences run by run.
fn section(all: &Comparison, metric: &str) -> Section {
    let rows = || all.table.iter().filter(move |c| c.metric == metric);
    let published = rows().any(|c| c.published.is_some());
    let against = format!("minus {}", all.reference);
    let error = rows().any(|c| c.valid.is_some());
    let mut numbers = vec!["mean", "95 % interval", "median"];
    if error {
        numbers[0] = "all samples";
        numbers.extend(["own valid", "of all", "common valid", "of all"]);
    }
    if published {
        numbers.insert(0, "published");
    }
    numbers.extend([against.as_str(), "95 % interval", "measured"]);
    let mut table = Table::new(&["estimator"], &numbers);
    for c in rows() {
        let mut row = vec![Cell::from(c.estimator.as_str())];
        if published {
            row.push(theirs(c));
        }
        let [mean, range] = words(c.mean);
        row.extend([mean, range, Cell::number(c.median)]);
        if error {
            row.extend(on_samples(c.valid.as_ref()));
            row.extend(on_samples(c.common.as_ref()));
        }
        row.extend([
            c.difference.map_or(Cell::number(None), |i| {
                Cell::difference(metric, i.mean, i.low, i.high)
            }),
            words(c.difference)[1].clone(),
            format!("{} of {}", c.measured, c.runs).into(),
        ]);
        table.row(row);
    }
    let doc = metrics::find(metric);
    Section::new(with_unit(metric, unit(metric)))
        .text(doc.map_or(String::new(), |m| format!("{}.", capital(m.doc))))
        .table(table)
        .figure(distribution(all, metric))
        .figure(differences(all, metric))
}

/// Mean and share of the samples.
fn on_samples(of: Option<&OnSamples>) -> [Cell; 2] {
    let share = of.and_then(|o| o.share);
    let [mean, _] = words(of.and_then(|o| o.mean));
    [
        mean,
        share.map_or(Cell::number(None), |s| format!("{:.1} %", 100.0 * s).into()),
    ]
}

fn words(interval: Option<Interval>) -> [Cell; 2] {
    match interval {
        Some(i) => [
            Cell::number(i.mean),
            format!("{} … {}", number(i.low), number(i.high)).into(),
        ],
        None => [Cell::number(None), Cell::number(None)],
    }
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|c| c.to_uppercase().to_string());
    first.unwrap_or_default() + letters.as_str()
}

/// An estimator has the same colour in every figure of the page.
fn inks(all: &Comparison) -> impl Iterator<Item = (&str, Ink)> {
    let names = names(all, |c| &c.estimator).into_iter();
    names.map(|name| (name, Ink::of_estimator(name)))
}

/// Values of an estimator; those of an estimator that is not judged do not set the axis.
fn group(all: &Comparison, (name, ink): (&str, Ink), values: Vec<Option<f64>>) -> ValueGroup<f64> {
    let main = is_main(&all.runs, name);
    ValueGroup::new(name, ink, values.into_iter().flatten().collect()).aside(!main)
}

fn distribution(all: &Comparison, metric: &str) -> Figure {
    let groups =
        inks(all).map(|(name, ink)| group(all, (name, ink), values(&all.runs, name, metric)));
    let groups = groups.filter(|g| !g.values.is_empty());
    let y = Axis::linear(with_unit(metric, unit(metric)));
    let mut boxes = Boxes::new("Over the runs", y, groups);
    let place = |c: &ComparedMetric| {
        let mut groups = boxes.groups.iter();
        let group = groups.position(|g| g.name == c.estimator)?;
        let value = c.published.as_ref()?.value.get();
        Some(("published".to_owned(), group, value))
    };
    let of_metric = all.table.iter().filter(|c| c.metric == metric);
    boxes.references = of_metric.filter_map(place).collect();
    boxes.figure()
}

fn differences(all: &Comparison, metric: &str) -> Figure {
    let others = inks(all).filter(|(name, _)| *name != all.reference);
    let groups = others.map(|(name, ink)| {
        let both = run_by_run(&all.runs, name, metric, &all.reference);
        group(all, (name, ink), both)
    });
    let groups = groups.filter(|g| !g.values.is_empty());
    let title = format!("Run by run, minus {}", all.reference);
    let y = Axis::linear(with_unit("difference", unit(metric)));
    Boxes::new(title, y, groups).figure()
}

/// Reasons why runs are missing in the figures.
fn left_out(all: &Comparison) -> Section {
    let mut table = Table::new(&["seed", "why"], &[]);
    for run in all.runs.iter().filter(|r| !r.finished()) {
        let why = run.error.as_deref();
        let why = why.unwrap_or("the run did not finish");
        table.row([run.seed.to_string().into(), why.into()]);
    }
    Section::new("Left out").table(table)
}
