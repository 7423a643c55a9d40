//! Metrics against what was drawn for each run.

use crate::metrics::estimator_metrics;
use crate::reports::page::Section;
use crate::reports::plot::axis::Axis;
use crate::reports::plot::scatter::Scatter;
use crate::reports::plot::theme::Ink;
use crate::reports::plot::{Figure, ValueGroup};
use crate::reports::study::ranks;
use crate::reports::study::values::{estimators, value};
use crate::text::with_unit;
use crate::verdicts::run_result::RunResult;
use crate::verdicts::summary::MAIN;
use serde_json::Value;
use std::collections::BTreeSet;

/// A plot for each varied quantity and each main metric that was measured; none if nothing varied.
pub(crate) fn section(runs: &[RunResult]) -> Option<Section> {
    let names: BTreeSet<&String> = runs.iter().flat_map(|r| r.draws.keys()).collect();
    if names.is_empty() {
        return None;
    }
    let mut section = Section::new("Against what varied")
        .text("Each dot is a run: a metric of an estimator over the value that was drawn.")
        .table(ranks::correlations(runs));
    for name in names {
        for metric in estimator_metrics().filter(|m| MAIN.contains(&m.name)) {
            let figure = plot(runs, name, metric.name, metric.unit);
            if figure.svg.is_some() {
                section = section.figure(figure);
            }
        }
    }
    Some(section)
}

fn plot(runs: &[RunResult], name: &str, metric: &str, unit: &str) -> Figure {
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
    for (i, estimator) in estimators(runs).into_iter().enumerate() {
        let points = runs.iter();
        let points = points.filter_map(|r| Some((place(r)?, value(r, Some(&estimator), metric)?)));
        let group = ValueGroup::new(&estimator, Ink::series(i), points.collect());
        if !group.values.is_empty() {
            scatter.groups.push(group);
        }
    }
    scatter.figure()
}

/// A drawn value as it would be written.
fn word(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}
