//! Metrics against the values drawn for each run.

use crate::metrics::{Metric, estimator_metrics};
use crate::reports::page::Section;
use crate::reports::plot::axis::Axis;
use crate::reports::plot::scatter::Scatter;
use crate::reports::plot::theme::Ink;
use crate::reports::plot::{Figure, ValueGroup};
use crate::reports::study::ranks;
use crate::reports::study::values::{estimators, is_main, value};
use crate::text::with_unit;
use crate::verdicts::run_result::RunResult;
use crate::verdicts::summary::MAIN;
use serde_json::Value;
use std::collections::BTreeSet;

/// A plot for each varied quantity and each measured main metric; `None` if no quantity varied. Over the values of a
/// grid, those of `swept`, lines go through the medians.
pub(crate) fn section(runs: &[RunResult], swept: &[String]) -> Option<Section> {
    let names: BTreeSet<&String> = runs.iter().flat_map(|r| r.draws.keys()).collect();
    if names.is_empty() {
        return None;
    }
    let mut section = Section::new("Metrics against the varied values")
        .text(
            "Each dot is a run: a metric of an estimator over the run's value. For a grid of values, lines join the medians.",
        )
        .table(ranks::correlations(runs));
    for name in names {
        for metric in estimator_metrics().filter(|m| MAIN.contains(&m.name)) {
            let figure = plot(runs, name, metric, swept.contains(name));
            if figure.svg.is_some() {
                section = section.figure(figure);
            }
        }
    }
    Some(section)
}

fn plot(runs: &[RunResult], name: &str, metric: &Metric, medians: bool) -> Figure {
    let Metric {
        name: metric, unit, ..
    } = *metric;
    // numbers stand where they are, words side by side
    let words: BTreeSet<String> = runs
        .iter()
        .filter_map(|r| r.draws.get(name))
        .filter(|v| !v.is_number())
        .map(word)
        .collect();
    let words: Vec<String> = words.into_iter().collect();
    let place = |run: &RunResult| {
        let drawn = run.draws.get(name)?;
        match drawn.as_f64() {
            Some(x) => Some(x),
            None => {
                let at = words.iter().position(|w| *w == word(drawn))?;
                Some(at as f64)
            }
        }
    };
    let x = match words.is_empty() {
        true => Axis::linear(name),
        false => Axis::names(name, words.clone()),
    };
    let y = Axis::linear(with_unit(metric, unit));
    let mut scatter = Scatter::new(format!("{metric} over {name}"), x, y);
    for estimator in estimators(runs) {
        let points = runs.iter();
        let points = points.filter_map(|r| Some((place(r)?, value(r, Some(&estimator), metric)?)));
        let group = ValueGroup::new(&estimator, Ink::of_estimator(&estimator), points.collect())
            .aside(!is_main(runs, &estimator));
        if medians {
            let lines = ValueGroup::new("", group.ink, medians_of(&group.values));
            scatter.lines.push(lines);
        }
        if !group.values.is_empty() {
            scatter.groups.push(group);
        }
    }
    scatter.figure()
}

/// The median of y at each x, x rising.
fn medians_of(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let same = sorted.chunk_by(|a, b| a.0 == b.0);
    let median = |all: &[(f64, f64)]| {
        let [low, high] = [all.get((all.len() - 1) / 2)?, all.get(all.len() / 2)?];
        Some((low.0, (low.1 + high.1) / 2.0))
    };
    same.filter_map(median).collect()
}

/// A drawn value as text.
fn word(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}
