//! Means, extremes and percentiles. Of nothing they are not a number.

/// Mean.
pub fn mean(x: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for x in x {
        sum += x;
        n += 1.0;
    }
    if n > 0.0 { sum / n } else { f64::NAN }
}

/// Root of the mean square.
pub fn rms(x: impl Iterator<Item = f64>) -> f64 {
    mean(x.map(|x| x * x)).sqrt()
}

/// Largest magnitude.
pub fn max(x: impl Iterator<Item = f64>) -> f64 {
    x.map(f64::abs).fold(f64::NAN, f64::max)
}

/// Share for which something holds.
pub fn share(x: impl Iterator<Item = bool>) -> f64 {
    mean(x.map(|yes| if yes { 1.0 } else { 0.0 }))
}

/// The value below which the share `p` (0…1) lies: the nearest of the values.
pub fn percentile(x: impl Iterator<Item = f64>, p: f64) -> f64 {
    let mut x: Vec<f64> = x.collect();
    let Some(last) = x.len().checked_sub(1) else {
        return f64::NAN;
    };
    let place = (last as f64 * p).round() as usize;
    *x.select_nth_unstable_by(place, f64::total_cmp).1
}

/// The 95 % point of χ² with one degree of freedom.
const CHI2_95: f64 = 3.841_458_820_694_124;

/// Share of normalised squares within the 95 % bound of χ² with one degree of freedom; not a number if one of them is not.
pub fn share_in_band(x: impl Iterator<Item = f64>) -> f64 {
    mean(x.map(|x| match x {
        x if x.is_nan() => x,
        x if x <= CHI2_95 => 1.0,
        _ => 0.0,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_nothing_no_number() {
        let nothing = || std::iter::empty();
        for x in [mean(nothing()), rms(nothing()), max(nothing())] {
            assert!(x.is_nan());
        }
        assert!(percentile(nothing(), 0.5).is_nan() && share_in_band(nothing()).is_nan());
    }

    #[test]
    fn percentiles_are_values_of_the_list() {
        let x = || (0..101).rev().map(f64::from);
        assert_eq!(percentile(x(), 0.95), 95.0);
        assert_eq!(percentile(x(), 0.0), 0.0);
        assert_eq!(percentile(x(), 1.0), 100.0);
        assert_eq!(percentile([7.0].into_iter(), 0.3), 7.0);
    }

    /// χ²₁ is the square of a standard normal: 1.96² bounds 95 % of it.
    #[test]
    fn the_band_is_that_of_chi_square() {
        assert!((CHI2_95.sqrt() - 1.959_963_984_540_054).abs() < 1e-14);
        assert_eq!(share_in_band([0.1, 3.8, 3.9, 50.0].into_iter()), 0.5);
        assert!(share_in_band([0.1, f64::NAN].into_iter()).is_nan());
    }
}
