//! Regression and correlation.

/// A regression of y on x with an intercept: slope, correlation, standard deviation of x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FittedLine {
    pub gain: f64,
    pub correlation: f64,
    pub sd_x: f64,
    pub n: usize,
}

/// Least squares over pairs of two numbers.
pub(super) fn line(pairs: impl Iterator<Item = (f64, f64)>) -> FittedLine {
    let pairs: Vec<(f64, f64)> = pairs
        .filter(|(x, y)| x.is_finite() && y.is_finite())
        .collect();
    let n = pairs.len() as f64;
    let (mx, my) = pairs
        .iter()
        .fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (x, y) in &pairs {
        xx += (x - mx) * (x - mx);
        xy += (x - mx) * (y - my);
        yy += (y - my) * (y - my);
    }
    FittedLine {
        gain: xy / xx,
        correlation: xy / (xx * yy).sqrt(),
        sd_x: (xx / n).sqrt(),
        n: pairs.len(),
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_line_is_found() {
        let l = super::line((0..100).map(|i| (f64::from(i), 3.0 - 0.5 * f64::from(i))));
        assert!((l.gain + 0.5).abs() < 1e-12 && (l.correlation + 1.0).abs() < 1e-12 && l.n == 100);
    }
}
