//! Summary of a battery whose conditions were drawn: no single one matters, but what all of them come to.

use crate::stress::{ConditionRow, MatrixCell, NOMINAL, StressRun};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// Share of misleading valid samples above which a condition counts as misleading for an estimator.
pub const MISLED: f64 = 0.005;

/// Results over all conditions, and over those of a class.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DrawnSummary {
    /// Results of each estimator over all conditions.
    pub estimators: Vec<EstimatorSummary>,
    /// Classes by kind, the worst first.
    pub classes: BTreeMap<String, Vec<ClassRow>>,
}

/// Results of an estimator over all conditions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EstimatorSummary {
    /// Figures over all runs.
    pub all: MatrixCell,
    /// Conditions.
    pub conditions: usize,
    /// Conditions in which more than [`MISLED`] of the valid samples of a quantity mislead.
    pub misled_in: usize,
    /// Median over the conditions of the time until all quantities have recovered, s; none = never.
    pub recovery_median_s: Option<f64>,
    /// Time within which all quantities have recovered in 90 % of the conditions, s; none = never.
    pub recovery_90_s: Option<f64>,
}

/// A class of conditions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClassRow {
    /// Class.
    pub class: String,
    /// Number of conditions; a condition with two faults is in the classes of both.
    pub conditions: usize,
    /// Largest share of misleading samples among the valid samples of a quantity, for each estimator.
    pub misled: Vec<Option<f64>>,
}

impl DrawnSummary {
    /// Sums up drawn conditions: those of a battery without the nominal row. None of another.
    pub(crate) fn of(
        rows: &[ConditionRow],
        estimators: &[String],
        cells: &[MatrixCell],
        runs: &[StressRun],
    ) -> Option<Self> {
        if rows.iter().any(|r| r.condition == NOMINAL) {
            return None;
        }
        let summary = |name: &String| {
            let own = cells.iter().filter(|c| c.estimator == *name);
            let own: Vec<&MatrixCell> = own.collect();
            let mut recoveries: Vec<f64> = own
                .iter()
                .map(|c| c.recovery_s().unwrap_or(f64::INFINITY))
                .collect();
            recoveries.sort_by(f64::total_cmp);
            let quantile = |q: f64| {
                let place = (q * recoveries.len() as f64).ceil() as usize;
                let at = recoveries.get(place.saturating_sub(1)).copied();
                at.filter(|s| s.is_finite())
            };
            let misled = own.iter().filter(|c| c.misled() > Some(MISLED));
            EstimatorSummary {
                all: MatrixCell::over("all", rows, name, runs),
                conditions: own.len(),
                misled_in: misled.count(),
                recovery_median_s: quantile(0.5),
                recovery_90_s: quantile(0.9),
            }
        };
        let of = rows.iter().flat_map(|r| r.classes.keys());
        let of: BTreeSet<&String> = of.collect();
        let classes = of.into_iter().map(|of| {
            let mut all = classes(of, rows, estimators, runs);
            let worst = |row: &ClassRow| row.misled.iter().flatten().fold(0.0, |a, b| b.max(a));
            all.sort_by(|a, b| worst(b).total_cmp(&worst(a)));
            (of.clone(), all)
        });
        Some(Self {
            estimators: estimators.iter().map(summary).collect(),
            classes: classes.collect(),
        })
    }
}

/// The classes of this kind, in alphabetical order.
fn classes(
    of: &str,
    rows: &[ConditionRow],
    estimators: &[String],
    runs: &[StressRun],
) -> Vec<ClassRow> {
    let mut members: BTreeMap<&String, Vec<ConditionRow>> = BTreeMap::new();
    for row in rows {
        for class in row.classes.get(of).into_iter().flatten() {
            members.entry(class).or_default().push(row.clone());
        }
    }
    let row = |(class, rows): (&String, Vec<ConditionRow>)| ClassRow {
        class: class.clone(),
        conditions: rows.len(),
        misled: estimators
            .iter()
            .map(|e| MatrixCell::over(class, &rows, e, runs).misled())
            .collect(),
    };
    members.into_iter().map(row).collect()
}
