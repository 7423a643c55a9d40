//! Least squares over windows that overlap.

use nalgebra::{DMatrix, SMatrix, SVector};

/// Residuals of windows without a common sample that are further apart than this are taken for independent, s.
const CORRELATED_S: f64 = 2.5;
/// Smallest eigenvalue of the correlations of the columns: below, they cannot be told apart.
const MIN_EIGENVALUE: f64 = 1e-9;

/// A row: time of the window (s), columns, value.
pub(crate) type RegressionRow<const N: usize> = (f64, SVector<f64, N>, f64);

/// Parameters and their standard deviations.
pub(crate) struct Fit<const N: usize> {
    pub value: [f64; N],
    pub sd: [f64; N],
}

/// Least squares over windows of this length, s; standard deviations are those of residuals that differ in size and are
/// correlated over time (Newey and West 1987). None of fewer than `least` rows, and none where columns are nearly
/// proportional.
pub(crate) fn regression<const N: usize>(
    rows: &[RegressionRow<N>],
    least: usize,
    length_s: f64,
) -> Option<Fit<N>> {
    if rows.len() < least.max(N + 1) {
        return None;
    }
    let (mut normal, mut right) = (SMatrix::<f64, N, N>::zeros(), SVector::<f64, N>::zeros());
    for (_, h, y) in rows {
        normal += h * h.transpose();
        right += h * *y;
    }
    let correlated_s = CORRELATED_S + length_s;
    let size = normal.diagonal().map(f64::sqrt);
    let scaled = DMatrix::from_fn(N, N, |i, j| normal[(i, j)] / (size[i] * size[j]));
    if !scaled.iter().all(|x| x.is_finite())
        || scaled.symmetric_eigenvalues().min() < MIN_EIGENVALUE
    {
        return None;
    }
    let inverse = normal.try_inverse()?;
    let value = inverse * right;
    let scores: Vec<(f64, SVector<f64, N>)> = rows
        .iter()
        .map(|(t, h, y)| (*t, h * (y - h.dot(&value))))
        .collect();
    let mut meat = SMatrix::<f64, N, N>::zeros();
    for (i, (t, s)) in scores.iter().enumerate() {
        meat += s * s.transpose();
        for (later, other) in scores.iter().skip(i + 1) {
            let share = 1.0 - (later - t) / correlated_s;
            if share <= 0.0 {
                break;
            }
            let both = s * other.transpose();
            meat += share * (both + both.transpose());
        }
    }
    // of about so many rows that are independent, N are used up
    let independent = (rows.last()?.0 - rows.first()?.0) / correlated_s;
    let few = (independent / (independent - N as f64).max(1.0)).max(1.0);
    let covariance = inverse * meat * inverse * few;
    Some(Fit {
        value: std::array::from_fn(|i| value[i]),
        sd: std::array::from_fn(|i| covariance[(i, i)].max(0.0).sqrt()),
    })
}

/// The share by which errors of the abscissa of this standard deviation can make a gain too small.
pub(crate) fn diluted(abscissa: impl Iterator<Item = f64>, sd: f64) -> f64 {
    let (n, sum, squares) = abscissa.fold((0.0, 0.0, 0.0), |(n, s, ss), x| {
        (n + 1.0, s + x, ss + x * x)
    });
    sd * sd / (squares / n - (sum / n).powi(2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Vector1, Vector2};

    /// At one force on the level gain and resistance are one: refused, and not made up.
    #[test]
    fn what_cannot_be_told_apart_is_refused() {
        let same = |i: i32| (f64::from(i), Vector2::new(1e4, -1e5), 0.0);
        assert!(regression(&(0..100).map(same).collect::<Vec<_>>(), 20, 0.5).is_none());
    }

    /// The mean of blocks of four equal numbers is known as well as that of one of each block: the variance of
    /// correlated rows is not that of so many independent ones.
    #[test]
    fn correlated_rows_count_as_fewer() {
        let number = |i: i32| (f64::from(i * 7919 % 1009) / 1009.0) - 0.5;
        let alone: Vec<_> = (0..1000)
            .map(|i| (f64::from(i) * 2.0, Vector1::new(1.0), number(i)))
            .collect();
        let repeated: Vec<_> = (0..4000)
            .map(|i| (f64::from(i) * 0.5, Vector1::new(1.0), number(i / 4)))
            .collect();
        let [a, b] = [&alone, &repeated].map(|rows| regression(rows, 20, 0.5).unwrap().sd[0]);
        assert!(b > 0.7 * a && b < 1.1 * a, "{a} {b}");
    }
}
