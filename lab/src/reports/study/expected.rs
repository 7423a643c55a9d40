//! Expectations over many runs: the measured values, with the bounds drawn in.

use crate::metrics;
use crate::reports::plot::axis::Axis;
use crate::reports::plot::boxes::Boxes;
use crate::reports::plot::theme::Ink;
use crate::reports::plot::{Figure, ValueGroup};
use crate::verdicts::run_result::RunResult;
use crate::verdicts::summary::ExpectationVerdict;

/// For each metric and window a figure with all estimators that it is expected of.
pub(crate) fn figures(runs: &[RunResult]) -> Vec<Figure> {
    let summaries = || runs.iter().filter_map(|r| r.summary.as_ref());
    let Some(first) = summaries().next() else {
        return Vec::new();
    };
    let ink = |estimator: &Option<String>| match estimator {
        Some(name) => Ink::of_estimator(name),
        None => Ink::Muted,
    };
    let mut kinds: Vec<(&str, &str)> = Vec::new();
    for expected in &first.expectations {
        let kind = (expected.metric.as_str(), expected.window.as_str());
        if !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    let figure = |(metric, window): (&str, &str)| {
        let mut groups = Vec::new();
        let mut bounds = Vec::new();
        let of = |v: &&ExpectationVerdict| v.metric == metric && v.window == window;
        for expected in first.expectations.iter().filter(of) {
            let same = |v: &&ExpectationVerdict| {
                of(v) && v.estimator == expected.estimator && v.bound() == expected.bound()
            };
            let values = summaries().filter_map(|s| s.expectations.iter().find(same)?.value);
            let values: Vec<f64> = values.collect();
            if !values.is_empty() {
                let both = expected.at_most.into_iter().chain(expected.at_least);
                bounds.extend(both.map(|bound| (groups.len(), bound)));
                let name = expected.estimator.as_deref().unwrap_or("the run");
                let name = format!("{name} {}", expected.bound());
                groups.push(ValueGroup::new(name, ink(&expected.estimator), values));
            }
        }
        Boxes {
            title: format!("{metric}{window}"),
            y: Axis::linear(metrics::with_unit(metric)),
            groups,
            references: Vec::new(),
            bounds,
        }
    };
    let all = kinds.into_iter().map(figure);
    all.filter(|boxes| !boxes.groups.is_empty())
        .map(Boxes::figure)
        .collect()
}
