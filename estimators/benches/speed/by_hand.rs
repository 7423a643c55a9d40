//! The same algorithms written out scalar by scalar, symmetric matrices as three numbers: what the general code must keep up with.

use monorig_estimators::Real;
use monorig_estimators::api::real::{PI, cos, ln, sin, sqrt};
use nalgebra::{Matrix2, Vector2, matrix, vector};

/// Slope from speed: v⁺ = v + dt (u − g (sin θ + μ cos θ)), u traction over mass.
#[derive(Clone, Copy)]
pub struct SlopeModel {
    pub dt: Real,
    pub q_v: Real,
    pub q_theta: Real,
    pub r: Real,
}

impl Default for SlopeModel {
    fn default() -> Self {
        Self {
            dt: 0.01,
            q_v: 1e-6,
            q_theta: 3e-6,
            r: 2.5e-5,
        }
    }
}

const GRAVITY: Real = 9.81;
const MU: Real = 0.02;

impl SlopeModel {
    pub fn transition(&self, x: &Vector2<Real>, u: Real) -> (Vector2<Real>, Matrix2<Real>) {
        let (sine, cosine) = (sin(x.y), cos(x.y));
        let by_theta = -self.dt * GRAVITY * (cosine - MU * sine);
        (
            vector![x.x + self.dt * (u - GRAVITY * (sine + MU * cosine)), x.y],
            matrix![1.0, by_theta; 0.0, 1.0],
        )
    }

    pub fn Q(&self) -> Matrix2<Real> {
        Matrix2::from_diagonal(&vector![self.q_v, self.q_theta])
    }
}

/// Extended Kalman filter of that model.
#[derive(Clone, Copy)]
pub struct Ekf {
    pub v: Real,
    pub theta: Real,
    pub p11: Real,
    pub p12: Real,
    pub p22: Real,
}

impl Ekf {
    pub fn new([sd_v, sd_theta]: [Real; 2]) -> Self {
        Self {
            v: 0.0,
            theta: 0.0,
            p11: sd_v * sd_v,
            p12: 0.0,
            p22: sd_theta * sd_theta,
        }
    }

    #[inline(never)]
    /// Predict and correct; [y, S, K₁, K₂, NIS, ln likelihood].
    pub fn step(&mut self, model: &SlopeModel, u: Real, z: Real) -> Option<[Real; 6]> {
        let (sine, cosine) = (sin(self.theta), cos(self.theta));
        let f = -model.dt * GRAVITY * (cosine - MU * sine);
        self.v += model.dt * (u - GRAVITY * (sine + MU * cosine));
        self.p11 += f * (2.0 * self.p12 + f * self.p22) + model.q_v;
        self.p12 += f * self.p22;
        self.p22 += model.q_theta;

        let y = z - self.v;
        let S = self.p11 + model.r;
        if S <= 0.0 {
            return None;
        }
        let nis = y * y / S;
        let log_likelihood = -0.5 * (nis + ln(2.0 * PI * S));
        if !nis.is_finite() || !log_likelihood.is_finite() {
            return None;
        }
        let (k1, k2) = (self.p11 / S, self.p12 / S);
        self.v += k1 * y;
        self.theta += k2 * y;
        // (I − K H) P (I − K H)ᵀ + K r Kᵀ with H = [1, 0]
        let a = 1.0 - k1;
        let (p11, p12, p22) = (self.p11, self.p12, self.p22);
        self.p11 = a * a * p11 + k1 * k1 * model.r;
        self.p12 = a * (p12 - k2 * p11) + k1 * k2 * model.r;
        self.p22 = p22 - k2 * (2.0 * p12 - k2 * p11) + k2 * k2 * model.r;
        Some([y, S, k1, k2, nis, log_likelihood])
    }
}

/// Least squares for two parameters as a textbook prints it.
#[derive(Clone, Copy)]
pub struct PlainRls {
    pub x: [Real; 2],
    p11: Real,
    p12: Real,
    p22: Real,
    lambda: Real,
}

impl PlainRls {
    pub fn new([sd1, sd2]: [Real; 2], lambda: Real) -> Self {
        Self {
            x: [0.0; 2],
            p11: sd1 * sd1,
            p12: 0.0,
            p22: sd2 * sd2,
            lambda,
        }
    }

    /// K = P h/(λ r + hᵀ P h), P ← (P − K hᵀ P)/λ; the residual.
    pub fn update(&mut self, y: Real, [h1, h2]: [Real; 2], r: Real) -> Real {
        let residual = y - h1 * self.x[0] - h2 * self.x[1];
        let (g1, g2) = (self.p11 * h1 + self.p12 * h2, self.p12 * h1 + self.p22 * h2);
        let S = self.lambda * r + h1 * g1 + h2 * g2;
        let (k1, k2) = (g1 / S, g2 / S);
        self.x[0] += k1 * residual;
        self.x[1] += k2 * residual;
        self.p11 = (self.p11 - k1 * g1) / self.lambda;
        self.p12 = (self.p12 - k1 * g2) / self.lambda;
        self.p22 = (self.p22 - k2 * g2) / self.lambda;
        residual
    }
}

/// Least squares for two parameters with all that the general one does: Joseph form, wind-up limit, running statistics of the
/// residual, all or nothing.
#[derive(Clone, Copy)]
pub struct Rls {
    pub x: [Real; 2],
    p11: Real,
    p12: Real,
    p22: Real,
    prior: [Real; 2],
    lambda: Real,
    spread: Real,
    tie: Real,
    last: Real,
    updates: u32,
}

impl Rls {
    pub fn new([sd1, sd2]: [Real; 2], lambda: Real) -> Self {
        Self {
            x: [0.0; 2],
            p11: sd1 * sd1,
            p12: 0.0,
            p22: sd2 * sd2,
            prior: [sd1 * sd1, sd2 * sd2],
            lambda,
            spread: 1.0,
            tie: 0.0,
            last: 0.0,
            updates: 0,
        }
    }

    /// [residual, normalised residual, λ, whether a limit acted]; `None`, and nothing changed, if the numbers allow no update.
    pub fn update(&mut self, y: Real, [h1, h2]: [Real; 2], r: Real) -> Option<[Real; 4]> {
        let residual = y - h1 * self.x[0] - h2 * self.x[1];
        let (g1, g2) = (self.p11 * h1 + self.p12 * h2, self.p12 * h1 + self.p22 * h2);
        let carried = h1 * g1 + h2 * g2;
        let normalised = residual / sqrt(r + carried);
        if !normalised.is_finite() {
            return None;
        }
        let aged = 1.0 / self.lambda;
        let (p11, p12, p22) = (self.p11 * aged, self.p12 * aged, self.p22 * aged);
        let S = r + carried * aged;
        if S <= 0.0 {
            return None;
        }
        let gain = aged / S;
        let (k1, k2) = (g1 * gain, g2 * gain);
        let (x1, x2) = (self.x[0] + k1 * residual, self.x[1] + k2 * residual);

        // B = (I − K hᵀ) P, then B (I − K hᵀ)ᵀ + K r Kᵀ
        let (a11, a12, a21, a22) = (1.0 - k1 * h1, -k1 * h2, -k2 * h1, 1.0 - k2 * h2);
        let (b11, b12) = (a11 * p11 + a12 * p12, a11 * p12 + a12 * p22);
        let (b21, b22) = (a21 * p11 + a22 * p12, a21 * p12 + a22 * p22);
        let mut n11 = b11 * a11 + b12 * a12 + k1 * r * k1;
        let mut n12 = b11 * a21 + b12 * a22 + k1 * r * k2;
        let mut n22 = b21 * a21 + b22 * a22 + k2 * r * k2;
        let limited = n11 > self.prior[0] || n22 > self.prior[1];
        if limited {
            let d1 = sqrt((self.prior[0] / n11).min(1.0));
            let d2 = sqrt((self.prior[1] / n22).min(1.0));
            (n11, n12, n22) = (n11 * d1 * d1, n12 * d1 * d2, n22 * d2 * d2);
        }
        if !(x1 + x2 + n11 + n12 + n22).is_finite() {
            return None;
        }

        let limit = 25.0 * self.spread.max(1e-12);
        let memory = Real::min(50.0, self.updates as Real + 2.0);
        self.tie += ((normalised * self.last).clamp(-limit, limit) - self.tie) / memory;
        self.spread += ((normalised * normalised).min(limit) - self.spread) / memory;
        self.last = normalised;
        self.updates = self.updates.saturating_add(1);
        self.x = [x1, x2];
        (self.p11, self.p12, self.p22) = (n11, n12, n22);
        Some([residual, normalised, self.lambda, f64::from(limited)])
    }
}
