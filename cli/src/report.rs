//! The result table.

use comfy_table::presets::UTF8_HORIZONTAL_ONLY;
use comfy_table::{CellAlignment, Table};

/// One number of the result, and its bound if it has one.
#[derive(Clone, Debug)]
pub struct Row {
    /// Seed of the run.
    pub seed: u64,
    /// Estimator; empty for metrics of the train or the controller.
    pub estimator: String,
    /// Metric and its unit.
    pub metric: String,
    /// Its value; none if it could not be measured.
    pub value: Option<f64>,
    /// Bound in words, such as `≤ 0.032`; none if there is none.
    pub bound: Option<String>,
    /// Whether the bound held; none if there is no bound.
    pub held: Option<bool>,
}

impl Row {
    /// A number without a bound.
    pub fn plain(seed: u64, estimator: &str, metric: &str, value: f64) -> Self {
        Self { seed, estimator: estimator.into(), metric: metric.into(), value: Some(value), bound: None, held: None }
    }
}

/// Whether the run is good: no bound failed, and no bound went unmeasured.
pub fn all_held(rows: &[Row]) -> bool {
    rows.iter().all(|row| {
        row.bound.is_none() || (row.held == Some(true) && row.value.is_some_and(f64::is_finite))
    })
}

/// The table as text.
pub fn table(rows: &[Row]) -> String {
    let mut table = Table::new();
    table.load_preset(UTF8_HORIZONTAL_ONLY);
    table.set_header(["seed", "estimator", "metric", "value", "bound", ""]);
    for row in rows {
        let value = match row.value {
            Some(x) => number(x),
            None => "not measured".to_owned(),
        };
        let verdict = match (&row.bound, row.held) {
            (None, _) => "",
            (Some(_), Some(true)) if row.value.is_some_and(f64::is_finite) => "held",
            _ => "FAILED",
        };
        table.add_row([
            row.seed.to_string(),
            row.estimator.clone(),
            row.metric.clone(),
            value,
            row.bound.clone().unwrap_or_default(),
            verdict.to_owned(),
        ]);
    }
    for right in [0, 3, 4] {
        if let Some(column) = table.column_mut(right) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    format!("{table}\n")
}

/// Four significant digits.
fn number(x: f64) -> String {
    match x.abs() {
        a if a != 0.0 && !(1e-3..1e6).contains(&a) => format!("{x:.3e}"),
        a if a < 1.0 => format!("{x:.5}"),
        a if a < 100.0 => format!("{x:.3}"),
        _ => format!("{x:.1}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(value: Option<f64>, bound: Option<&str>, held: Option<bool>) -> Row {
        Row {
            seed: 1,
            estimator: "jekf".into(),
            metric: "mass_error_rel_max".into(),
            value,
            bound: bound.map(str::to_owned),
            held,
        }
    }

    #[test]
    fn a_bound_without_a_number_has_failed() {
        assert!(all_held(&[
            row(Some(0.1), Some("≤ 1"), Some(true)),
            row(None, None, None)
        ]));
        for bad in [
            row(Some(2.0), Some("≤ 1"), Some(false)),
            row(None, Some("≤ 1"), Some(true)),
            row(Some(f64::NAN), Some("≤ 1"), Some(true)),
            row(Some(0.5), Some("≤ 1"), None),
        ] {
            assert!(!all_held(std::slice::from_ref(&bad)));
            assert!(table(&[bad]).contains("FAILED"));
        }
    }
}
