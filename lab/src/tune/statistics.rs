//! Means with confidence intervals.

use serde::Serialize;

/// A mean and its 95 % confidence interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Interval {
    /// Mean.
    pub mean: f64,
    /// Lower end; −∞ of a single value.
    pub low: f64,
    /// Upper end; ∞ of a single value.
    pub high: f64,
    /// Values.
    pub n: usize,
}

/// Mean of values and its 95 % confidence interval after Student, for values that are independent and roughly normal.
pub fn interval(values: &[f64]) -> Interval {
    let n = values.len();
    let count = n as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (count - 1.0);
    let half = if n < 2 {
        f64::INFINITY
    } else {
        student(n - 1) * (variance / count).sqrt()
    };
    Interval {
        mean,
        low: mean - half,
        high: mean + half,
        n,
    }
}

/// The 97.5 % quantile of Student's distribution with so many degrees of freedom, to 0.1 %: a table to 10, then Cornish and
/// Fisher's expansion (Abramowitz and Stegun 26.7.5).
fn student(freedom: usize) -> f64 {
    const TABLE: [f64; 10] = [
        12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228,
    ];
    if let Some(t) = freedom.checked_sub(1).and_then(|i| TABLE.get(i)) {
        return *t;
    }
    let (z, n) = (1.959964_f64, freedom as f64);
    z + (z.powi(3) + z) / (4.0 * n)
        + (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / (96.0 * n * n)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tabulated values (Abramowitz and Stegun, table 26.10).
    #[test]
    fn quantiles_are_those_of_the_table() {
        for (freedom, t) in [
            (1, 12.706),
            (10, 2.228),
            (11, 2.201),
            (20, 2.086),
            (60, 2.000),
            (120, 1.980),
        ] {
            assert!((student(freedom) / t - 1.0).abs() < 1e-3, "{freedom}");
        }
    }

    /// Student 1908, Cushny and Peebles' sleep data: mean 1.58 h, standard deviation 1.23 h, 10 patients; 0.70 … 2.46.
    #[test]
    fn interval_of_students_own_example() {
        let gains = [1.2, 2.4, 1.3, 1.3, 0.0, 1.0, 1.8, 0.8, 4.6, 1.4];
        let i = interval(&gains);
        assert!((i.mean - 1.58).abs() < 1e-9);
        assert!(
            (i.low - 0.70).abs() < 5e-3 && (i.high - 2.46).abs() < 5e-3,
            "{i:?}"
        );
        assert_eq!(interval(&[1.0]).high, f64::INFINITY);
    }
}
