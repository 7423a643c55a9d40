//! Overlapping Allan deviation.
//!
//! With θ the running sum of the samples times their period T, τ = mT:
//! σ²(τ) = Σ (θ(k+2m) − 2θ(k+m) + θ(k))² / (2τ²(N − 2m)) over the N − 2m terms there are (Riley, "Handbook of
//! Frequency Stability Analysis", NIST SP 1065, equation 11). Pieces of a recording are pooled: their sums and
//! numbers of terms add.

/// Averaging times per decade.
const PER_DECADE: f64 = 8.0;

/// Least independent averages behind a point.
const MIN_AVERAGES: f64 = 4.0;

/// The deviation at one averaging time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AllanPoint {
    /// Averaging time, s.
    pub tau_s: f64,
    /// Deviation, in the unit of the samples.
    pub deviation: f64,
    /// Independent averages behind it: samples over m. The relative standard deviation of the point is about
    /// 1/√(2·averages).
    pub(crate) averages: f64,
}

/// Deviation of pooled pieces sampled every `period_s`, at averaging times from one period to a quarter of the
/// longest piece.
pub fn overlapping(pieces: &[&[f64]], period_s: f64) -> Vec<AllanPoint> {
    let sums: Vec<Vec<f64>> = pieces.iter().map(|p| running_sum(p, period_s)).collect();
    let longest = pieces.iter().map(|p| p.len()).max().unwrap_or(0);
    let mut points = Vec::new();
    let (mut last, mut step) = (0, 0.0);
    loop {
        let m = 10_f64.powf(step / PER_DECADE).round() as usize;
        step += 1.0;
        if m == last {
            continue;
        }
        last = m;
        if (longest as f64) < MIN_AVERAGES * m as f64 {
            return points;
        }
        if let Some(point) = at(&sums, m, period_s) {
            points.push(point);
        }
    }
}

/// The deviation at m samples; `None` if no piece is long enough.
fn at(sums: &[Vec<f64>], m: usize, period_s: f64) -> Option<AllanPoint> {
    let tau_s = m as f64 * period_s;
    let (mut squares, mut terms, mut samples) = (0.0, 0, 0);
    for theta in sums.iter().filter(|theta| theta.len() > 2 * m) {
        squares += theta
            .windows(2 * m + 1)
            .map(|w| (w[2 * m] - 2.0 * w[m] + w[0]).powi(2))
            .sum::<f64>();
        terms += theta.len() - 2 * m;
        samples += theta.len() - 1;
    }
    (terms > 0).then(|| AllanPoint {
        tau_s,
        deviation: (squares / (2.0 * tau_s * tau_s * terms as f64)).sqrt(),
        averages: samples as f64 / m as f64,
    })
}

/// Sum of the samples minus their mean, times the period: a constant does not show in the deviation, but takes digits.
fn running_sum(x: &[f64], period_s: f64) -> Vec<f64> {
    let mean = x.iter().sum::<f64>() / x.len().max(1) as f64;
    let mut theta = Vec::with_capacity(x.len() + 1);
    let mut sum = 0.0;
    theta.push(0.0);
    for value in x {
        sum += (value - mean) * period_s;
        theta.push(sum);
    }
    theta
}

#[cfg(test)]
mod tests {
    use super::*;

    /// NIST SP 1065, table 31 (the set of nine numbers): the overlapping deviation at τ = 2 is 85.95287.
    #[test]
    fn it_agrees_with_the_published_example() {
        let x = [
            892.0, 809.0, 823.0, 798.0, 671.0, 644.0, 883.0, 903.0, 677.0,
        ];
        let points = overlapping(&[&x], 1.0);
        let of = |tau: f64| points.iter().find(|p| p.tau_s == tau).unwrap().deviation;
        assert!((of(1.0) - 91.22945).abs() < 1e-5, "{}", of(1.0));
        assert!((of(2.0) - 85.95287).abs() < 1e-5, "{}", of(2.0));
    }

    #[test]
    fn a_constant_has_none_and_a_ramp_its_slope() {
        let constant = vec![9.81; 1000];
        assert!(
            overlapping(&[&constant], 0.01)
                .iter()
                .all(|p| p.deviation < 1e-12)
        );
        // Two averages τ apart differ by the slope times τ: σ = slope·τ/√2.
        let ramp: Vec<f64> = (0..1000).map(|k| 0.03 * f64::from(k)).collect();
        for p in overlapping(&[&ramp], 0.01) {
            let expected = 3.0 * p.tau_s / 2_f64.sqrt();
            assert!((p.deviation / expected - 1.0).abs() < 1e-6, "{p:?}");
        }
    }

    #[test]
    fn pieces_are_pooled_without_the_step_between_them() {
        let low: Vec<f64> = (0..500).map(|k| f64::from(k % 7)).collect();
        let high: Vec<f64> = low.iter().map(|x| x + 1000.0).collect();
        let together = overlapping(&[&low, &high], 0.1);
        for (a, b) in together.iter().zip(overlapping(&[&low], 0.1)) {
            assert!((a.deviation - b.deviation).abs() < 1e-9);
        }
    }
}
