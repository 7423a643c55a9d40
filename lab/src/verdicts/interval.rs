//! Means with their 95 % confidence intervals.

use monorig_sim::sensors::stream::Stream;
use serde::{Deserialize, Serialize};

/// A mean and the interval that contains the true mean with a confidence of 95 %.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Mean.
    pub mean: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Number of values.
    pub(crate) n: usize,
}

/// Resamples of a bootstrap.
const RESAMPLES: usize = 4000;

impl Interval {
    /// Interval after Student, for independent and roughly normal values. Of a single value the ends are infinite, of
    /// none nothing is a number.
    pub(crate) fn student(values: &[f64]) -> Self {
        let n = values.len();
        let count = n as f64;
        let mean = values.iter().sum::<f64>() / count;
        let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (count - 1.0);
        let half = if n < 2 {
            f64::INFINITY
        } else {
            student(n - 1) * (variance / count).sqrt()
        };
        Self {
            mean,
            low: mean - half,
            high: mean + half,
            n,
        }
    }

    /// Interval of the ratio of two sums over pairs, with the percentile bootstrap over the pairs. None of fewer than
    /// two, or if the second sum is 0.
    pub(crate) fn ratio(pairs: &[(f64, f64)]) -> Option<Self> {
        let of = |pairs: &[(f64, f64)]| {
            let (above, below) = pairs
                .iter()
                .fold((0.0, 0.0), |(a, b), (x, y)| (a + x, b + y));
            above / below
        };
        let mut stream = Stream::new(1, "bootstrap of a ratio");
        let mut drawn = vec![(0.0, 0.0); pairs.len()];
        Self::resampled(of(pairs), pairs.len(), || {
            for pair in &mut drawn {
                let i = (stream.uniform() * pairs.len() as f64) as usize;
                *pair = pairs.get(i).copied().unwrap_or_default();
            }
            of(&drawn)
        })
    }

    /// Interval with the percentile bootstrap (Efron & Tibshirani 1993, chapter 13), for values of any distribution;
    /// the draws are always the same. None of fewer than two values.
    pub(crate) fn bootstrap(values: &[f64]) -> Option<Self> {
        let n = values.len() as f64;
        let mut stream = Stream::new(1, "bootstrap");
        Self::resampled(values.iter().sum::<f64>() / n, values.len(), || {
            let draw = |_| values.get((stream.uniform() * n) as usize).copied();
            (0..values.len()).filter_map(draw).sum::<f64>() / n
        })
    }

    /// Interval between percentiles of repeated draws from `n` values; `None` for fewer than two values.
    fn resampled(mean: f64, n: usize, draw: impl FnMut() -> f64) -> Option<Self> {
        if n < 2 || !mean.is_finite() {
            return None;
        }
        let drawn = std::iter::repeat_with(draw).take(RESAMPLES);
        let mut drawn: Vec<f64> = drawn.filter(|x| x.is_finite()).collect();
        drawn.sort_unstable_by(f64::total_cmp);
        let last = drawn.len().checked_sub(1)? as f64;
        let at = |share: f64| drawn.get((share * last).round() as usize).copied();
        Some(Self {
            mean,
            low: at(0.025)?,
            high: at(0.975)?,
            n,
        })
    }
}

/// 97.5 % quantile of Student's t: from tables to twenty degrees of freedom, then by the expansion of Cornish and
/// Fisher (Abramowitz and Stegun 1964, 26.7.5), whose error is below 1e-4 there.
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

    /// Tabulated values, two-sided 95 % (Abramowitz and Stegun 1964, table 26.10, and its successors).
    #[test]
    fn t_is_that_of_the_tables() {
        for (freedom, t) in [
            (1, 12.7062),
            (10, 2.2281),
            (11, 2.2010),
            (20, 2.0860),
            (21, 2.0796),
            (49, 2.0096),
            (60, 2.0003),
            (120, 1.9799),
            (1000, 1.9623),
        ] {
            let ours = student(freedom);
            assert!((ours - t).abs() < 1e-4, "{freedom}: {ours}");
        }
    }

    /// Student 1908, Cushny and Peebles' sleep data: mean 1.58 h, standard deviation 1.23 h, 10 patients; 0.70 … 2.46.
    #[test]
    fn interval_of_students_own_example() {
        let gains = [1.2, 2.4, 1.3, 1.3, 0.0, 1.0, 1.8, 0.8, 4.6, 1.4];
        let i = Interval::student(&gains);
        assert!((i.mean - 1.58).abs() < 1e-9);
        assert!(
            (i.low - 0.70).abs() < 5e-3 && (i.high - 2.46).abs() < 5e-3,
            "{i:?}"
        );
        assert_eq!(Interval::student(&[1.0]).high, f64::INFINITY);
        assert!(Interval::student(&[]).mean.is_nan());
    }

    /// The ratio of an error to three times itself is a third, with no width; where one pair is more the other is less.
    #[test]
    fn ratios_of_sums() {
        let third = Interval::ratio(&[(1.0, 3.0), (2.0, 6.0), (0.5, 1.5)]).unwrap();
        for x in [third.mean, third.low, third.high] {
            assert!((x - 1.0 / 3.0).abs() < 1e-12, "{third:?}");
        }
        let spread = Interval::ratio(&[(1.0, 2.0), (2.0, 2.0), (3.0, 2.0)]).unwrap();
        assert!((spread.mean - 1.0).abs() < 1e-12);
        assert!(spread.low < 0.9 && spread.high > 1.1, "{spread:?}");
        assert_eq!(Interval::ratio(&[(1.0, 2.0)]), None);
        assert_eq!(Interval::ratio(&[(1.0, 0.0), (1.0, 0.0)]), None);
    }

    /// Of 400 samples of 30 normals each, the interval of about 95 % holds the true mean: the percentile bootstrap of
    /// 30 values is a little too narrow (about 93.5 %); the share has a standard error of 1.2 %.
    #[test]
    fn bootstrapped_intervals_hold_the_true_mean_as_often_as_they_say() {
        let mut stream = Stream::new(5, "samples");
        let holds = (0..400).filter(|_| {
            let x: Vec<f64> = (0..30).map(|_| 3.0 + stream.normal()).collect();
            Interval::bootstrap(&x).is_some_and(|i| i.low <= 3.0 && 3.0 <= i.high)
        });
        let share = holds.count() as f64 / 400.0;
        assert!((0.90..=0.98).contains(&share), "{share}");
        assert_eq!(Interval::bootstrap(&[1.0]), None);
    }
}
