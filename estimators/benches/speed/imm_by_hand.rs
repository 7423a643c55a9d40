//! Interacting multiple models: two filters of [s, v, a] under a measurement of s, scalar by scalar, symmetric matrices as six numbers.

use monorig_estimators::Real;
use monorig_estimators::api::real::{PI, exp, ln};

/// Mean and lower triangle of the covariance: p₀₀, p₁₀, p₂₀, p₁₁, p₂₁, p₂₂.
#[derive(Clone, Copy)]
pub struct Belief {
    pub x: [Real; 3],
    pub p: [Real; 6],
}

impl Belief {
    /// x ← F x, P ← F P Fᵀ + Q with F = [1, dt, dt²/2; 0, 1, dt; 0, 0, 1].
    #[inline(always)]
    fn predict(&mut self, dt: Real, q: [Real; 3]) {
        let h = 0.5 * dt * dt;
        let [s, v, a] = self.x;
        self.x = [s + dt * v + h * a, v + dt * a, a];
        let [p00, p10, p20, p11, p21, p22] = self.p;
        // rows of F P
        let (a00, a01, a02) = (
            p00 + dt * p10 + h * p20,
            p10 + dt * p11 + h * p21,
            p20 + dt * p21 + h * p22,
        );
        let (a11, a12) = (p11 + dt * p21, p21 + dt * p22);
        self.p = [
            a00 + dt * a01 + h * a02 + q[0],
            a01 + dt * a02,
            a02,
            a11 + dt * a12 + q[1],
            a12,
            p22 + q[2],
        ];
    }

    /// Joseph form with H = [1, 0, 0]; ln likelihood.
    #[inline(always)]
    fn correct(&mut self, z: Real, r: Real) -> Option<Real> {
        let [p00, p10, p20, p11, p21, p22] = self.p;
        let (y, S) = (z - self.x[0], p00 + r);
        if S <= 0.0 {
            return None;
        }
        let [k0, k1, k2] = [p00 / S, p10 / S, p20 / S];
        let nis = y * y / S;
        let log_likelihood = -0.5 * (nis + ln(2.0 * PI * S));
        if !nis.is_finite() || !log_likelihood.is_finite() {
            return None;
        }
        self.x = [self.x[0] + k0 * y, self.x[1] + k1 * y, self.x[2] + k2 * y];
        // B = P − K (P Hᵀ)ᵀ, then B − (B Hᵀ − K r) Kᵀ
        let (b00, b10, b20) = (p00 - k0 * p00, p10 - k1 * p00, p20 - k2 * p00);
        let (b11, b21, b22) = (p11 - k1 * p10, p21 - k2 * p10, p22 - k2 * p20);
        let (c0, c1, c2) = (b00 - k0 * r, b10 - k1 * r, b20 - k2 * r);
        self.p = [
            b00 - c0 * k0,
            b10 - c1 * k0,
            b20 - c2 * k0,
            b11 - c1 * k1,
            b21 - c2 * k1,
            b22 - c2 * k2,
        ];
        Some(log_likelihood)
    }
}

/// Mean and covariance of a mixture of two.
#[inline(always)]
fn mixture([a, b]: &[Belief; 2], [wa, wb]: [Real; 2]) -> Belief {
    let x: [Real; 3] = std::array::from_fn(|i| a.x[i] * wa + b.x[i] * wb);
    let da: [Real; 3] = std::array::from_fn(|i| a.x[i] - x[i]);
    let db: [Real; 3] = std::array::from_fn(|i| b.x[i] - x[i]);
    const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 0), (2, 0), (1, 1), (2, 1), (2, 2)];
    let p = std::array::from_fn(|n| {
        let (i, j) = PAIRS[n];
        (a.p[n] + da[i] * da[j]) * wa + (b.p[n] + db[i] * db[j]) * wb
    });
    Belief { x, p }
}

/// Two models with fixed transitions.
#[derive(Clone, Copy)]
pub struct Imm {
    pub beliefs: [Belief; 2],
    pub probability: [Real; 2],
    stay: Real,
}

impl Imm {
    pub fn new(sd: [Real; 3], stay: Real) -> Self {
        let [a, b, c] = sd.map(|sd| sd * sd);
        let belief = Belief {
            x: [0.0; 3],
            p: [a, 0.0, 0.0, b, 0.0, c],
        };
        Self {
            beliefs: [belief; 2],
            probability: [0.5; 2],
            stay,
        }
    }

    /// Mix, predict, correct, weigh, combine.
    #[inline(never)]
    pub fn cycle(&mut self, dt: Real, q: &[[Real; 3]; 2], z: Real, r: Real) -> Belief {
        let ([m0, m1], stay, leave) = (self.probability, self.stay, 1.0 - self.stay);
        let (c0, c1) = (stay * m0 + leave * m1, leave * m0 + stay * m1);
        let mut beliefs = [
            mixture(&self.beliefs, [m0 * stay / c0, m1 * leave / c0]),
            mixture(&self.beliefs, [m0 * leave / c1, m1 * stay / c1]),
        ];
        let mut logs = [-1e3; 2];
        for ((belief, q), log) in beliefs.iter_mut().zip(q).zip(&mut logs) {
            belief.predict(dt, *q);
            *log = belief.correct(z, r).unwrap_or(-1e3);
        }
        self.beliefs = beliefs;
        self.probability = [c0, c1];
        let largest = logs[0].max(logs[1]);
        let (w0, w1) = (exp(logs[0] - largest) * c0, exp(logs[1] - largest) * c1);
        let sum = w0 + w1;
        if sum > 0.0 && sum.is_finite() {
            let (w0, w1) = ((w0 / sum).max(1e-4), (w1 / sum).max(1e-4));
            let sum = w0 + w1;
            self.probability = [w0 / sum, w1 / sum];
        }
        mixture(&self.beliefs, self.probability)
    }
}
