//! A metric over runs, and what can be said of it.

use crate::report::html::number;
use crate::report::plot::boxes::quantile;
use crate::study::RunResult;
use std::collections::BTreeSet;

/// A metric over runs, in ascending order.
pub struct Values {
    /// Runs there are.
    pub runs: usize,
    /// Values of those runs in which it could be measured.
    pub measured: Vec<f64>,
}

impl Values {
    /// A metric of an estimator, or of the run.
    pub fn of(runs: &[RunResult], estimator: Option<&str>, metric: &str) -> Self {
        let values = runs.iter().filter_map(|run| value(run, estimator, metric));
        Self::new(runs.len(), values.collect())
    }

    /// Values in any order, of so many runs.
    pub fn new(runs: usize, mut measured: Vec<f64>) -> Self {
        measured.sort_unstable_by(f64::total_cmp);
        Self { runs, measured }
    }

    /// Mean; not a number without values.
    pub fn mean(&self) -> f64 {
        self.measured.iter().sum::<f64>() / self.measured.len() as f64
    }

    /// Quantile.
    pub fn quantile(&self, p: f64) -> f64 {
        quantile(&self.measured, p)
    }

    /// 95 % confidence interval of the mean by Student's t; not a number for less than two values.
    pub fn interval(&self) -> (f64, f64) {
        let n = self.measured.len();
        if n < 2 {
            return (f64::NAN, f64::NAN);
        }
        let mean = self.mean();
        let squares = self.measured.iter().map(|x| (x - mean).powi(2));
        let variance = squares.sum::<f64>() / (n - 1) as f64;
        let half = student(n - 1) * (variance / n as f64).sqrt();
        (mean - half, mean + half)
    }

    /// The same in words.
    pub fn interval_text(&self) -> String {
        let (low, high) = self.interval();
        match low.is_finite() {
            true => format!("{} … {}", number(low), number(high)),
            false => number(f64::NAN),
        }
    }
}

/// A metric of an estimator, or of the run, in one run; none if it could not be measured.
pub fn value(run: &RunResult, estimator: Option<&str>, metric: &str) -> Option<f64> {
    let summary = run.summary.as_ref()?;
    let all = match estimator {
        Some(name) => summary.estimators.get(name)?,
        None => &summary.run,
    };
    let value = all.get(metric).copied().flatten();
    value.filter(|x| x.is_finite())
}

/// Estimators of these runs.
pub fn estimators(runs: &[RunResult]) -> Vec<String> {
    let names = runs.iter().filter_map(|r| r.summary.as_ref());
    let names: BTreeSet<&String> = names.flat_map(|s| s.estimators.keys()).collect();
    names.into_iter().cloned().collect()
}

/// 97.5 % quantile of Student's t: from tables to twenty degrees of freedom, then by the expansion of Cornish and Fisher (Abramowitz
/// and Stegun 1964, 26.7.5), whose error is below 1e-4 there.
fn student(freedom: usize) -> f64 {
    const TABLE: [f64; 20] = [
        12.7062, 4.3027, 3.1824, 2.7764, 2.5706, 2.4469, 2.3646, 2.3060, 2.2622, 2.2281, 2.2010,
        2.1788, 2.1604, 2.1448, 2.1314, 2.1199, 2.1098, 2.1009, 2.0930, 2.0860,
    ];
    if let Some(t) = freedom.checked_sub(1).and_then(|i| TABLE.get(i)) {
        return *t;
    }
    let (z, n) = (1.959_964_f64, freedom as f64);
    let (z3, z5, z7) = (z.powi(3), z.powi(5), z.powi(7));
    z + (z3 + z) / (4.0 * n)
        + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * n * n)
        + (3.0 * z7 + 19.0 * z5 + 17.0 * z3 - 15.0 * z) / (384.0 * n.powi(3))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tables of Student's t, two-sided 95 %.
    #[test]
    fn t_is_that_of_the_tables() {
        for (freedom, t) in [
            (1, 12.7062),
            (10, 2.2281),
            (11, 2.2010),
            (20, 2.0860),
            (49, 2.0096),
            (1000, 1.9623),
        ] {
            assert!(
                (student(freedom) - t).abs() < 1e-4,
                "{freedom}: {}",
                student(freedom)
            );
        }
    }
}
