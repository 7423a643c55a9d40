//! White noise, bias instability and random walk from an Allan deviation.
//!
//! σ²(τ) = N²/τ + B²·2 ln 2/π + K²τ/3 (IEEE Std 952-1997, annex C), N the random walk of the integral (one-sided
//! density N√2), B the bias instability, K the random walk of the bias. Least squares of the relative error of σ²,
//! each point weighted by the number of its independent averages; coefficients below zero are left out, and so is one
//! that the data do not need: a term must lower the weighted sum by more than chance would (χ² of one degree of
//! freedom, 4σ).

use super::allan::AllanPoint;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::{LN_2, PI};

/// Least decrease of χ² by a further term.
const SIGNIFICANT: f64 = 16.0;

/// Number of neighbouring points that carry the same information, as neighbouring averaging times share their samples:
/// of eight per decade (8 log₁₀ 2).
const SHARED: f64 = 2.4;

/// Coefficients, in the unit u of the samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseFit {
    /// White noise N, u·√s: the sheet's `random_walk_of_integral`.
    pub white: f64,
    /// Bias instability B, u; `None` if it is not visible.
    pub instability: Option<f64>,
    /// Averaging time at which the fitted deviation is least, s; of an instability only.
    pub instability_s: Option<f64>,
    /// Random walk K of the bias, u/√s; `None` if it is not visible.
    pub(crate) random_walk: Option<f64>,
    /// Root mean square of the relative error of the fitted deviation: below some 0.1 the three terms describe the
    /// recording.
    pub misfit: f64,
}

impl NoiseFit {
    /// White noise as one-sided density, u/√Hz: the sheet's `noise_density`.
    pub fn density(&self) -> f64 {
        self.white * 2_f64.sqrt()
    }

    /// The fitted deviation at τ.
    pub(crate) fn deviation(&self, tau_s: f64) -> f64 {
        let squares = [
            self.white,
            self.instability.unwrap_or(0.0),
            self.random_walk.unwrap_or(0.0),
        ]
        .map(|x| x * x);
        let terms = terms(tau_s);
        (0..3).map(|i| squares[i] * terms[i]).sum::<f64>().sqrt()
    }
}

fn terms(tau_s: f64) -> [f64; 3] {
    [1.0 / tau_s, 2.0 * LN_2 / PI, tau_s / 3.0]
}

/// Fit of the three terms; `None` with fewer than four points above zero.
pub fn fit(points: &[AllanPoint]) -> Option<NoiseFit> {
    let points: Vec<&AllanPoint> = points.iter().filter(|p| p.deviation > 0.0).collect();
    if points.len() < 4 {
        return None;
    }
    // White noise is always there; the others one by one, then both.
    let mut best = solve(&points, &[0])?;
    for columns in [&[0, 1][..], &[0, 2], &[0, 1, 2]] {
        let Some(more) = solve(&points, columns) else {
            continue;
        };
        let needed = SIGNIFICANT * (columns.len() - best.1.len()).max(1) as f64;
        if best.2 - more.2 > needed {
            best = more;
        }
    }
    let (squares, columns, _) = best;
    let root = |i: usize| columns.contains(&i).then(|| squares[i].sqrt());
    let mut found = NoiseFit {
        white: squares[0].sqrt(),
        instability: root(1),
        instability_s: None,
        random_walk: root(2),
        misfit: 0.0,
    };
    let misfit = points
        .iter()
        .map(|p| (found.deviation(p.tau_s) / p.deviation - 1.0).powi(2))
        .sum::<f64>()
        / points.len() as f64;
    found.misfit = misfit.sqrt();
    found.instability_s = found.instability.and_then(|_| {
        let least = points.iter().min_by(|a, b| {
            let of = |p: &&&AllanPoint| found.deviation(p.tau_s);
            of(a).total_cmp(&of(b))
        });
        least.map(|p| p.tau_s)
    });
    Some(found)
}

/// Squares of the coefficients of these columns, the columns, and χ²; `None` if a square is below zero.
fn solve(points: &[&AllanPoint], columns: &[usize]) -> Option<([f64; 3], Vec<usize>, f64)> {
    // Relative variance of σ² of about `averages` independent squares: 2/averages.
    let weight = |p: &AllanPoint| (0.5 * p.averages).sqrt();
    let row = |p: &AllanPoint| {
        let all = terms(p.tau_s);
        let used = |i: usize| if columns.contains(&i) { all[i] } else { 0.0 };
        Vector3::from_fn(|i, _| weight(p) * used(i) / p.deviation.powi(2))
    };
    // Normal equations of columns scaled to length 1; a column that is not used is its own unknown, 0.
    let mut lengths = Vector3::zeros();
    for p in points {
        lengths += row(p).component_mul(&row(p));
    }
    let scale = lengths.map(|l: f64| if l > 0.0 { 1.0 / l.sqrt() } else { 0.0 });
    let mut matrix = Matrix3::from_diagonal(&scale.map(|s| if s > 0.0 { 0.0 } else { 1.0 }));
    let mut right = Vector3::zeros();
    for p in points {
        let scaled = row(p).component_mul(&scale);
        matrix += scaled * scaled.transpose();
        right += scaled * weight(p);
    }
    let x = matrix.cholesky()?.solve(&right).component_mul(&scale);
    if columns.iter().any(|i| !(x[*i].is_finite() && x[*i] > 0.0)) {
        return None;
    }
    let chi2 = points
        .iter()
        .map(|p| (row(p).dot(&x) - weight(p)).powi(2))
        .sum::<f64>()
        / SHARED;
    Some((x.into(), columns.to_vec(), chi2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recordings::allan::overlapping;
    use monorig_sim::sensors::noise::{RandomWalk, White};
    use monorig_sim::sensors::stream::Stream;

    const T: f64 = 0.01;

    /// A million samples of white noise of density N = 0.02·√T and a random walk of K = 0.004 per √s.
    fn samples(white_sd: f64, walk: f64, count: usize, seed: u64) -> Vec<f64> {
        let mut white = White::new(white_sd, 0.0, Stream::new(seed, "white"));
        let mut bias = RandomWalk::new(walk, T, Stream::new(seed, "walk"));
        (0..count)
            .map(|_| white.draw(0.0) + if walk > 0.0 { bias.draw() } else { 0.0 })
            .collect()
    }

    /// White noise alone: N to 1 %, nothing else found, in the two conventions of a density.
    #[test]
    fn white_noise_is_found_and_nothing_else() {
        for seed in 1..=5 {
            let x = samples(0.2, 0.0, 1 << 18, seed);
            let found = fit(&overlapping(&[&x], T)).unwrap();
            assert!((found.white / 0.02 - 1.0).abs() < 0.01, "{found:?}");
            assert!((found.density() / (0.02 * 2_f64.sqrt()) - 1.0).abs() < 0.01);
            assert!(
                found.instability.is_none() && found.random_walk.is_none(),
                "{found:?}"
            );
            assert!(found.misfit < 0.2, "{found:?}");
        }
    }

    /// With a random walk both are found: its long averages are few, hence 15 %.
    #[test]
    fn white_noise_and_random_walk_are_told_apart() {
        for seed in 1..=5 {
            let x = samples(0.2, 0.01, 1 << 18, seed);
            let found = fit(&overlapping(&[&x], T)).unwrap();
            assert!((found.white / 0.02 - 1.0).abs() < 0.02, "{found:?}");
            let walk = found.random_walk.unwrap();
            assert!((walk / 0.01 - 1.0).abs() < 0.15, "{found:?}");
        }
    }

    /// Exact points of the model come back exactly.
    #[test]
    fn the_model_fits_itself() {
        let truth = NoiseFit {
            white: 3e-4,
            instability: Some(2e-4),
            instability_s: None,
            random_walk: Some(1e-5),
            misfit: 0.0,
        };
        let points: Vec<AllanPoint> = (0..50)
            .map(|k| {
                let tau_s = 0.01 * 10_f64.powf(f64::from(k) / 8.0);
                AllanPoint {
                    tau_s,
                    deviation: truth.deviation(tau_s),
                    averages: 1e7 / tau_s,
                }
            })
            .collect();
        let found = fit(&points).unwrap();
        for (a, b) in [
            (found.white, 3e-4),
            (found.instability.unwrap(), 2e-4),
            (found.random_walk.unwrap(), 1e-5),
        ] {
            assert!((a / b - 1.0).abs() < 1e-9, "{found:?}");
        }
        assert!(found.misfit < 1e-9);
    }
}
