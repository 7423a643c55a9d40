//! Figures over all runs of a test: metrics of each estimator over scenarios and seeds alike.

use crate::ui::tables::{lines, right, shown, table};
use crate::verdicts::TestedScenario;
use monorig_lab::metrics;
use std::collections::BTreeMap;

/// A table for each metric: number of runs with a value, median, 95th percentile and worst value, with the run of this
/// value.
pub fn text(tested: &[TestedScenario], wanted: &[String]) -> String {
    let tables = wanted.iter().map(|metric| of_metric(tested, metric));
    tables.collect::<Vec<_>>().join("\n\n")
}

/// Values of one estimator, each with its scenario and seed.
type Values<'a> = Vec<(f64, &'a str, u64)>;

fn of_metric(tested: &[TestedScenario], metric: &str) -> String {
    let mut all: BTreeMap<&str, (usize, Values<'_>)> = BTreeMap::new();
    for one in tested {
        for run in &one.judged.runs {
            for (name, of) in run.summary.iter().flat_map(|s| &s.estimators) {
                let (runs, values) = all.entry(name).or_default();
                *runs += 1;
                if let Some(value) = of.get(metric).copied().flatten() {
                    values.push((value, &one.judged.scenario, run.seed));
                }
            }
        }
    }
    let title = metrics::with_unit(metric);
    let titles = [title.as_str(), "runs", "median", "95 %", "largest", "in"];
    let mut table = table(titles);
    for (name, (runs, mut values)) in all {
        values.sort_by(|a, b| a.0.total_cmp(&b.0));
        let at = |quantile: f64| {
            let last = values.len().checked_sub(1)?;
            let place = (quantile * last as f64).round() as usize;
            values.get(place).map(|v| v.0)
        };
        let largest = values.last();
        table.add_row([
            name.to_owned(),
            format!("{}/{runs}", values.len()),
            shown(at(0.5)),
            shown(at(0.95)),
            shown(largest.map(|v| v.0)),
            largest.map_or(String::new(), |(_, scenario, seed)| {
                format!("{scenario} seed {seed}")
            }),
        ]);
    }
    right(&mut table, 1..5);
    lines(&table)
}
