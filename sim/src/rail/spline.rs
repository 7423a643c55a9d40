//! The natural cubic smoothing spline.
//!
//! Among all curves f that miss the points yᵢ by a root mean square of at most σ, the one with the least ∫f″²
//! (Reinsch, "Smoothing by spline functions", Numer. Math. 10, 1967). With g = f(xᵢ), γ = f″(xᵢ), and the band matrices
//! Q, R of Green & Silverman (Nonparametric Regression, 1994, eqs 2.5–2.9) it solves
//!
//! ```text
//! (R + λ QᵀQ) γ = Qᵀ y,    g = y − λ Q γ,
//! ```
//!
//! with λ such that the mean of (y − g)² is σ². σ = 0 gives λ = 0: the interpolating natural spline.

/// Values and second derivatives at the knots.
#[derive(Clone, Debug)]
pub(crate) struct Spline {
    x: Vec<f64>,
    g: Vec<f64>,
    gamma: Vec<f64>,
}

impl Spline {
    /// Smooth `y` over the strictly growing `x` (at least three points each, equally many) to a root mean square miss
    /// of `sigma`.
    pub(crate) fn smooth(x: &[f64], y: &[f64], sigma: f64) -> Self {
        let solve = |lambda: f64| Self::solve(x, y, lambda);
        if sigma <= 0.0 {
            return solve(0.0);
        }
        let miss = |s: &Self| {
            let sum: f64 = s.g.iter().zip(y).map(|(g, y)| (g - y) * (g - y)).sum();
            (sum / y.len() as f64).sqrt()
        };
        // the miss grows with λ; bisect its logarithm between "interpolates" and "straight line"
        let span = x[x.len() - 1] - x[0];
        let gap = span / x.len() as f64;
        let (mut low, mut high) = (
            1e-9 * gap * gap * gap,
            1e4 * span * span * span * span / gap,
        );
        if miss(&solve(high)) <= sigma {
            return solve(high);
        }
        if miss(&solve(low)) >= sigma {
            return solve(low);
        }
        for _ in 0..80 {
            let middle = (low * high).sqrt();
            if miss(&solve(middle)) > sigma {
                high = middle;
            } else {
                low = middle;
            }
        }
        solve(low)
    }

    /// Values at the knots: the points, smoothed.
    pub(crate) fn knots(&self) -> &[f64] {
        &self.g
    }

    fn solve(x: &[f64], y: &[f64], lambda: f64) -> Self {
        let n = x.len();
        let h = |i: usize| x[i + 1] - x[i];
        // column j of Q (interior knot j + 1) has these three entries in rows j, j + 1, j + 2
        let q = |j: usize| [1.0 / h(j), -1.0 / h(j) - 1.0 / h(j + 1), 1.0 / h(j + 1)];
        let m = n - 2;
        // A = R + λ QᵀQ: diagonal and two bands, then A = L D Lᵀ in place
        let (mut d, mut e, mut f) = (vec![0.0; m], vec![0.0; m], vec![0.0; m]);
        let mut gamma = vec![0.0; m];
        for j in 0..m {
            let a = q(j);
            d[j] = (h(j) + h(j + 1)) / 3.0 + lambda * (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
            if j + 1 < m {
                let b = q(j + 1);
                e[j] = h(j + 1) / 6.0 + lambda * (a[1] * b[0] + a[2] * b[1]);
            }
            if j + 2 < m {
                f[j] = lambda * a[2] * q(j + 2)[0];
            }
            gamma[j] = a[0] * y[j] + a[1] * y[j + 1] + a[2] * y[j + 2];
        }
        for j in 0..m {
            let (ej, fj) = (e[j], f[j]);
            if j + 1 < m {
                let l = ej / d[j];
                d[j + 1] -= l * ej;
                e[j + 1] -= l * fj;
                gamma[j + 1] -= l * gamma[j];
                e[j] = l;
            }
            if j + 2 < m {
                let l = fj / d[j];
                d[j + 2] -= l * fj;
                gamma[j + 2] -= l * gamma[j];
                f[j] = l;
            }
        }
        for j in (0..m).rev() {
            gamma[j] /= d[j];
            if j + 1 < m {
                gamma[j] -= e[j] * gamma[j + 1];
            }
            if j + 2 < m {
                gamma[j] -= f[j] * gamma[j + 2];
            }
        }
        let mut g = y.to_vec();
        for j in 0..m {
            for (i, q) in q(j).into_iter().enumerate() {
                g[j + i] -= lambda * q * gamma[j];
            }
        }
        gamma.insert(0, 0.0);
        gamma.push(0.0);
        Self {
            x: x.to_vec(),
            g,
            gamma,
        }
    }

    /// Per gap: where it begins and ends, and f = Σ cᵢ (x − from)ⁱ on it.
    pub(crate) fn cubics(&self) -> impl Iterator<Item = (f64, f64, [f64; 4])> + '_ {
        (0..self.x.len() - 1).map(|i| {
            let h = self.x[i + 1] - self.x[i];
            let (g0, g1) = (self.gamma[i], self.gamma[i + 1]);
            let slope = (self.g[i + 1] - self.g[i]) / h - h * (2.0 * g0 + g1) / 6.0;
            (
                self.x[i],
                self.x[i + 1],
                [self.g[i], slope, 0.5 * g0, (g1 - g0) / (6.0 * h)],
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    fn uneven(n: usize) -> Vec<f64> {
        (0..n)
            .map(|i| i as f64 * 1.7 + 0.6 * libm::sin(i as f64 * 2.3))
            .collect()
    }

    fn wavy(x: &[f64]) -> Vec<f64> {
        x.iter()
            .enumerate()
            .map(|(i, x)| libm::sin(0.3 * x) + 0.05 * libm::cos(i as f64 * 12.9))
            .collect()
    }

    /// Value of a piecewise cubic, first and second derivative continuous: what makes it a cubic spline.
    #[test]
    fn pieces_join_to_the_second_derivative_and_ends_are_free() {
        let x = uneven(40);
        for sigma in [0.0, 0.03, 10.0] {
            let s: Vec<_> = Spline::smooth(&x, &wavy(&x), sigma).cubics().collect();
            for w in s.windows(2) {
                let ((from, to, a), (_, _, b)) = (w[0], w[1]);
                let h = to - from;
                let value = a[0] + h * (a[1] + h * (a[2] + h * a[3]));
                let slope = a[1] + h * (2.0 * a[2] + h * 3.0 * a[3]);
                let second = 2.0 * a[2] + 6.0 * h * a[3];
                assert!(
                    (value - b[0]).abs() < 1e-12
                        && (slope - b[1]).abs() < 1e-10
                        && (second - 2.0 * b[2]).abs() < 1e-10
                );
            }
            let (from, to, last) = s[s.len() - 1];
            assert!(
                s[0].2[2].abs() < 1e-15
                    && (2.0 * last[2] + 6.0 * (to - from) * last[3]).abs() < 1e-12
            );
        }
    }

    #[test]
    fn without_noise_it_interpolates_and_with_much_it_is_the_regression_line() {
        let x = uneven(30);
        let y = wavy(&x);
        for ((_, _, c), y) in Spline::smooth(&x, &y, 0.0).cubics().zip(&y) {
            assert!((c[0] - y).abs() < 1e-14);
        }
        let n = x.len() as f64;
        let (mx, my) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
        let slope = x
            .iter()
            .zip(&y)
            .map(|(x, y)| (x - mx) * (y - my))
            .sum::<f64>()
            / x.iter().map(|x| (x - mx) * (x - mx)).sum::<f64>();
        for (from, _, c) in Spline::smooth(&x, &y, 100.0).cubics() {
            assert!(
                (c[0] - (my + slope * (from - mx))).abs() < 1e-3 && (c[1] - slope).abs() < 1e-3
            );
        }
    }

    #[test]
    fn it_misses_the_points_by_sigma() {
        let x = uneven(200);
        let y = wavy(&x);
        let s = Spline::smooth(&x, &y, 0.03);
        let miss =
            (s.g.iter()
                .zip(&y)
                .map(|(g, y)| (g - y) * (g - y))
                .sum::<f64>()
                / 200.0)
                .sqrt();
        assert!((miss - 0.03).abs() < 1e-9, "{miss}");
    }

    /// Oracle: Green & Silverman eq 2.11, g = (1 + λ Q R⁻¹ Qᵀ)⁻¹ y, with dense matrices.
    #[test]
    fn it_solves_the_dense_normal_equations() {
        let x = uneven(12);
        let y = wavy(&x);
        let n = x.len();
        let h: Vec<f64> = x.windows(2).map(|w| w[1] - w[0]).collect();
        let mut q = DMatrix::zeros(n, n - 2);
        let mut r = DMatrix::zeros(n - 2, n - 2);
        for j in 0..n - 2 {
            q[(j, j)] = 1.0 / h[j];
            q[(j + 1, j)] = -1.0 / h[j] - 1.0 / h[j + 1];
            q[(j + 2, j)] = 1.0 / h[j + 1];
            r[(j, j)] = (h[j] + h[j + 1]) / 3.0;
            if j + 1 < n - 2 {
                r[(j, j + 1)] = h[j + 1] / 6.0;
                r[(j + 1, j)] = h[j + 1] / 6.0;
            }
        }
        let lambda = 2.7;
        let k = &q * r.try_inverse().unwrap() * q.transpose();
        let g = (DMatrix::identity(n, n) + k * lambda)
            .try_inverse()
            .unwrap()
            * DVector::from_vec(y.clone());
        for (ours, dense) in Spline::solve(&x, &y, lambda).g.iter().zip(g.iter()) {
            assert!((ours - dense).abs() < 1e-12);
        }
    }
}
