//! Metrics of two runs beside each other.

use super::Pair;
use crate::metrics::{Metric, estimator_metrics};
use crate::reports::page::Section;
use crate::reports::table::{Cell, Table};
use crate::text::with_unit;
use crate::verdicts::summary::MAIN;
use std::collections::BTreeMap;

type FigureValues = BTreeMap<String, Option<f64>>;

/// The main metrics of the estimators of both runs.
pub(crate) fn section(pair: &Pair) -> Section {
    let mut table = Table::new(&["estimator", "metric"], &["A", "B", "B minus A"]);
    table.caption = format!(
        "From {} s on; a difference is coloured by whether B is better or worse",
        pair.a.summary.after_s
    );
    for name in pair.estimators() {
        for metric in estimator_metrics().filter(|m| MAIN.contains(&m.name)) {
            let row = row(metric, of(pair, name));
            table.row(std::iter::once(name.into()).chain(row));
        }
    }
    let section = Section::new("Key figures").table(table);
    let only = |of: &BTreeMap<String, FigureValues>, other: &BTreeMap<String, FigureValues>| {
        let names = of.keys().filter(|n| !other.contains_key(*n));
        names.cloned().collect::<Vec<_>>().join(", ")
    };
    let (a, b) = (&pair.a.summary.estimators, &pair.b.summary.estimators);
    let sides = [("A", only(a, b)), ("B", only(b, a))].into_iter();
    sides
        .filter(|(_, names)| !names.is_empty())
        .fold(section, |section, (letter, names)| {
            section.text(format!("Only in {letter}: {names}."))
        })
}

fn of<'a>(pair: &'a Pair, estimator: &str) -> [Option<&'a FigureValues>; 2] {
    [&pair.a, &pair.b].map(|run| run.summary.estimators.get(estimator))
}

/// Metric, its values, and their difference.
fn row(metric: &Metric, of: [Option<&FigureValues>; 2]) -> [Cell; 4] {
    let value = |values: Option<&FigureValues>| {
        let value = values.and_then(|v| v.get(metric.name).copied().flatten());
        value.unwrap_or(f64::NAN)
    };
    let [a, b] = of.map(value);
    [
        with_unit(metric.name, metric.unit).into(),
        Cell::number(a),
        Cell::number(b),
        Cell::difference(metric.name, b - a, b - a, b - a),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::verdicts::judgement::Grade;

    #[test]
    fn a_difference_is_judged_by_what_is_better() {
        let difference = |metric: &str, x: f64| Cell::difference(metric, x, x, x);
        assert_eq!(difference("slope_rmse_deg", -0.1).grade, Some(Grade::Held));
        assert_eq!(difference("slope_rmse_deg", 0.1).grade, Some(Grade::Failed));
        assert_eq!(
            difference("slope_availability", 0.1).grade,
            Some(Grade::Held)
        );
        assert_eq!(difference("slope_rmse_deg", 0.0).grade, None);
        assert_eq!(difference("slope_rmse_deg", f64::NAN).grade, None);
    }
}
