//! Rank correlation of drawn values with metrics: which of the things that varied goes with the errors.

use crate::metrics::{Metric, estimator_metrics};
use crate::reports::study::values::{estimators, value};
use crate::reports::table::{Cell, Table};
use crate::verdicts::run_result::RunResult;
use crate::verdicts::summary::MAIN;
use std::collections::BTreeSet;

/// Least number of runs for a correlation.
const MIN_RUNS: usize = 6;
/// Half width of the middle 95 % of a normal distribution, in standard deviations.
const TWO_SIDED_95: f64 = 1.96;
/// Largest number of rows, strongest first.
const SHOWN: usize = 30;

/// Spearman's coefficient of every drawn number with every main metric of all samples, strongest first; `None` without
/// enough runs.
pub(crate) fn correlations(runs: &[RunResult]) -> Option<Table> {
    let names: BTreeSet<&String> = runs.iter().flat_map(|r| r.draws.keys()).collect();
    let mut rows = Vec::new();
    for name in names {
        for estimator in estimators(runs) {
            let shown = |m: &&Metric| MAIN.contains(&m.name) && !m.is_of_valid();
            for metric in estimator_metrics().filter(shown) {
                let pair = |run: &RunResult| {
                    let drawn = run.draws.get(name)?.as_f64()?;
                    Some((drawn, value(run, Some(&estimator), metric.name)?))
                };
                let pairs: Vec<(f64, f64)> = runs.iter().filter_map(pair).collect();
                let rho = spearman(&pairs).filter(|_| pairs.len() >= MIN_RUNS);
                rows.extend(
                    rho.map(|rho| (name, estimator.clone(), metric.name, rho, pairs.len())),
                );
            }
        }
    }
    if rows.is_empty() {
        return None;
    }
    rows.sort_by(|a, b| b.3.abs().total_cmp(&a.3.abs()));
    let all = rows.len();
    rows.truncate(SHOWN);
    let mut table = Table::new(
        &["drawn", "estimator", "metric"],
        &["rank correlation", "by chance", "runs"],
    );
    table.caption = format!(
        "Rank correlation (Spearman) of drawn values with metrics, the {} strongest of {all}: + the metric grows with the value, − it \
         falls. Without any connection 19 of 20 lie within ± the figure under \"by chance\"",
        rows.len()
    );
    for (name, estimator, metric, rho, n) in rows {
        let chance = TWO_SIDED_95 / (n as f64 - 1.0).sqrt();
        let cell = Cell::from(format!("{rho:+.2}"));
        table.row([
            name.clone().into(),
            estimator.into(),
            metric.into(),
            match rho.abs() > chance {
                true => cell.judged(false),
                false => cell,
            },
            format!("{chance:.2}").into(),
            n.to_string().into(),
        ]);
    }
    Some(table)
}

/// Spearman's rank correlation: Pearson's of the ranks, equal values with their mean rank. None where one of the two
/// does not vary.
fn spearman(pairs: &[(f64, f64)]) -> Option<f64> {
    let x = ranks(pairs.iter().map(|p| p.0));
    let y = ranks(pairs.iter().map(|p| p.1));
    let mean = (pairs.len() as f64 + 1.0) / 2.0;
    let sum = |a: &[f64], b: &[f64]| -> f64 {
        let both = a.iter().zip(b);
        both.map(|(a, b)| (a - mean) * (b - mean)).sum()
    };
    let size = (sum(&x, &x) * sum(&y, &y)).sqrt();
    (size > 0.0).then(|| sum(&x, &y) / size)
}

/// Rank of each value, from 1; equal values have their mean rank.
fn ranks(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<(usize, f64)> = values.enumerate().collect();
    sorted.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut ranks = vec![0.0; sorted.len()];
    let mut below = 0;
    for equal in sorted.chunk_by(|a, b| a.1 == b.1) {
        let rank = below as f64 + (equal.len() as f64 + 1.0) / 2.0;
        for (i, _) in equal {
            if let Some(place) = ranks.get_mut(*i) {
                *place = rank;
            }
        }
        below += equal.len();
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_of_equal_values_are_their_mean() {
        assert_eq!(
            ranks([3.0, 1.0, 3.0, 2.0].into_iter()),
            [3.5, 1.0, 3.5, 2.0]
        );
    }

    /// Kendall & Gibbons 1990: ±1 for any monotone connection. The third is scipy.stats.spearmanr([1, 2, 3, 4, 5],
    /// [5, 6, 7, 8, 7]).
    #[test]
    fn monotone_is_one_however_bent() {
        let of = |y: &[f64]| {
            let pairs: Vec<_> = y.iter().enumerate().map(|(i, y)| (i as f64, *y)).collect();
            spearman(&pairs)
        };
        assert!((of(&[1.0, 10.0, 11.0, 1e6]).unwrap() - 1.0).abs() < 1e-12);
        assert!((of(&[4.0, 3.0, 2.5, -8.0]).unwrap() + 1.0).abs() < 1e-12);
        assert!((of(&[5.0, 6.0, 7.0, 8.0, 7.0]).unwrap() - 0.820_782_681_668_123).abs() < 1e-12);
        assert!(of(&[1.0, 1.0, 1.0]).is_none());
    }
}
