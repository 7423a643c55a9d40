//! Numbers that say how good a run was.
//!
//! Errors are estimate minus truth; the slope's truth is the grade at the IMU. Only samples that the estimator marks valid
//! count, and `*_valid_share` says how many those were: a metric without a single valid sample is not a number, never zero.
//! `docs/src/metrics.md` has the same table, and a test sees to it.

mod of_estimator;
mod of_run;
pub mod series;
mod statistics;

pub use of_estimator::METRICS;
pub use of_run::RUN_METRICS;

use crate::metrics::series::{ErrorSample, ErrorSeries, Tracking};

/// A metric over samples of a kind: name, unit and definition.
pub struct Metric<T> {
    /// Name, as in `expect`.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// What it is.
    pub doc: &'static str,
    value: fn(&[T]) -> f64,
}

/// A metric of one estimator over the time from `after_s` to `until_s`; none if there is no such metric or estimator.
pub fn measure(
    series: &ErrorSeries,
    estimator: &str,
    metric: &str,
    after_s: f64,
    until_s: f64,
) -> Option<f64> {
    let (_, samples) = series
        .estimators
        .iter()
        .find(|(name, _)| name == estimator)?;
    let metric = METRICS.iter().find(|m| m.name == metric)?;
    let window = between(samples, |x: &ErrorSample| x.t_s, after_s, until_s);
    Some((metric.value)(window))
}

/// A metric of the train or the controller over the time from `after_s` to `until_s`; none if there is no such metric.
pub fn measure_run(series: &ErrorSeries, metric: &str, after_s: f64, until_s: f64) -> Option<f64> {
    let metric = RUN_METRICS.iter().find(|m| m.name == metric)?;
    let window = between(&series.tracking, |x: &Tracking| x.t_s, after_s, until_s);
    Some((metric.value)(window))
}

/// The unit of a metric of either kind; none if there is no such metric.
pub fn unit(metric: &str) -> Option<&'static str> {
    let of_estimator = METRICS.iter().map(|m| (m.name, m.unit));
    let of_run = RUN_METRICS.iter().map(|m| (m.name, m.unit));
    of_estimator
        .chain(of_run)
        .find_map(|(name, unit)| (name == metric).then_some(unit))
}

/// Whether a metric is the better the less it is; none of those that should be 1 on average, neither less nor more.
pub fn less_is_better(metric: &str) -> Option<bool> {
    match metric {
        m if m.ends_with("_valid_share") => Some(false),
        m if m.ends_with("_mean") || m.ends_with("_in_band") => None,
        _ => Some(true),
    }
}

fn between<T>(samples: &[T], t_s: fn(&T) -> f64, after_s: f64, until_s: f64) -> &[T] {
    let from = samples.partition_point(|x| t_s(x) < after_s);
    let to = samples.partition_point(|x| t_s(x) <= until_s);
    samples.get(from..to).unwrap_or(&[])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The page has a row for every metric, with its unit and its definition, and none besides.
    #[test]
    fn the_page_of_metrics_is_the_table() {
        let page = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/src/metrics.md");
        let page = std::fs::read_to_string(page).unwrap();
        let of_estimator = METRICS.iter().map(|m| (m.name, m.unit, m.doc));
        let of_run = RUN_METRICS.iter().map(|m| (m.name, m.unit, m.doc));
        let mut rows: Vec<String> = of_estimator
            .chain(of_run)
            // a bar within a cell of Markdown's tables is written \|
            .map(|(name, unit, doc)| format!("| `{name}` | {unit} | {} |", doc.replace('|', "\\|")))
            .collect();
        let mut there: Vec<&str> = page.lines().filter(|l| l.starts_with("| `")).collect();
        rows.sort();
        there.sort_unstable();
        assert_eq!(there, rows);
    }
}
