//! Unscented Kalman filter of two states under a measurement of the first, scalar by scalar: what the general code must keep up with.

use monorig_estimators::Real;
use monorig_estimators::api::real::{PI, ln, sqrt};
use monorig_estimators::filters::ukf::Spread;

/// Mean and covariance.
#[derive(Clone, Copy)]
pub struct Ukf {
    pub x: [Real; 2],
    pub p11: Real,
    pub p12: Real,
    pub p22: Real,
}

impl Ukf {
    pub fn new([sd1, sd2]: [Real; 2]) -> Self {
        Self {
            x: [0.0; 2],
            p11: sd1 * sd1,
            p12: 0.0,
            p22: sd2 * sd2,
        }
    }

    /// l₁₁, l₂₁, l₂₂ of P = L Lᵀ.
    #[inline(always)]
    fn root(&self) -> Option<[Real; 3]> {
        if self.p11 <= 0.0 {
            return None;
        }
        let rest = self.p22 - self.p12 * self.p12 / self.p11;
        if rest <= 0.0 {
            return None;
        }
        let l11 = sqrt(self.p11);
        Some([l11, self.p12 / l11, sqrt(rest)])
    }

    /// Predict by `f` with independent process noise `q`, and correct by `z` of the first state with noise `r`;
    /// [y, S, K₁, K₂, NIS, ln likelihood].
    #[inline(always)]
    pub fn step(
        &mut self,
        spread: &Spread,
        f: impl Fn([Real; 2]) -> [Real; 2],
        [q1, q2]: [Real; 2],
        z: Real,
        r: Real,
    ) -> Option<[Real; 6]> {
        let square = spread.alpha * spread.alpha;
        let scale = square * (2.0 + spread.kappa);
        let (root, share) = (sqrt(scale), 1.0 / scale);
        let of_mean = (scale - 2.0) / scale;
        let of_covariance = of_mean + 1.0 - square + spread.beta;
        let half = 0.5 / root;

        let [l11, l21, l22] = self.root()?;
        let [x1, x2] = self.x;
        let (a1, a2, b2) = (root * l11, root * l21, root * l22);
        let [c1, c2] = f([x1, x2]);
        let ([p1, p2], [m1, m2]) = (f([x1 + a1, x2 + a2]), f([x1 - a1, x2 - a2]));
        let ([s1, s2], [n1, n2]) = (f([x1, x2 + b2]), f([x1, x2 - b2]));
        let (ga1, ga2) = ((p1 - m1) * half, (p2 - m2) * half);
        let (gb1, gb2) = ((s1 - n1) * half, (s2 - n2) * half);
        let (ma1, ma2) = (0.5 * (p1 + m1), 0.5 * (p2 + m2));
        let (mb1, mb2) = (0.5 * (s1 + n1), 0.5 * (s2 + n2));
        let mean1 = c1 * of_mean + (ma1 + mb1) * share;
        let mean2 = c2 * of_mean + (ma2 + mb2) * share;
        let (c1, c2) = (c1 - mean1, c2 - mean2);
        let (ma1, ma2, mb1, mb2) = (ma1 - mean1, ma2 - mean2, mb1 - mean1, mb2 - mean2);
        let product = |u: [Real; 3], v: [Real; 3]| {
            of_covariance * u[0] * v[0] + share * (u[1] * v[1] + u[2] * v[2])
        };
        let (bent1, bent2) = ([c1, ma1, mb1], [c2, ma2, mb2]);
        self.x = [mean1, mean2];
        self.p11 = ga1 * ga1 + gb1 * gb1 + product(bent1, bent1) + q1;
        self.p12 = ga1 * ga2 + gb1 * gb2 + product(bent1, bent2);
        self.p22 = ga2 * ga2 + gb2 * gb2 + product(bent2, bent2) + q2;

        let [l11, l21, l22] = self.root()?;
        let a = root * l11;
        let (plus, minus) = (mean1 + a, mean1 - a);
        let (g1, g2) = ((plus - minus) * half, 0.0);
        let middle = 0.5 * (plus + minus);
        let mean = mean1 * of_mean + (middle + mean1) * share;
        let (c, ma, mb) = (mean1 - mean, middle - mean, mean1 - mean);
        let r = r + product([c, ma, mb], [c, ma, mb]);

        let y = z - mean;
        let (h1, h2) = (l11 * g1, l21 * g1 + l22 * g2);
        let S = g1 * g1 + g2 * g2 + r;
        if S <= 0.0 {
            return None;
        }
        let (k1, k2, nis) = (h1 / S, h2 / S, y * y / S);
        let log_likelihood = -0.5 * (nis + ln(2.0 * PI * S));
        if !nis.is_finite() || !log_likelihood.is_finite() {
            return None;
        }
        let (e11, e12) = (l11 - k1 * g1, -k1 * g2);
        let (e21, e22) = (l21 - k2 * g1, l22 - k2 * g2);
        self.x = [mean1 + k1 * y, mean2 + k2 * y];
        self.p11 = e11 * e11 + e12 * e12 + k1 * k1 * r;
        self.p12 = e11 * e21 + e12 * e22 + k1 * k2 * r;
        self.p22 = e21 * e21 + e22 * e22 + k2 * k2 * r;
        Some([y, S, k1, k2, nis, log_likelihood])
    }
}
