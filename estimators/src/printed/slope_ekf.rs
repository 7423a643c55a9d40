//! Extended Kalman filter for [v, θ] with the Sage-Husa estimator of all four noise statistics, as Liu et al. 2023
//! print it in eq. 23–30 and the patent CN 111507019 B in eq. 36–48.
//!
//! v⁻ = v + dt v̇, θ⁻ = θ, plus q; z = v, minus r; d = (1 − κ)/(1 − κᵏ), k = 1, 2, …
//!
//! - q ← (1 − d) q + d (x⁺ − f(x)), r ← (1 − d) r + d (z − x⁻₁)
//! - Q ← (1 − d) Q + d (K ε² Kᵀ + P⁺ − A P Aᵀ); in print ξ ψ ξᵀ is subtracted, one number from a matrix, which an array
//!   language takes from every element
//! - R ← (1 − d) R + d (ε² − H P⁻ Hᵀ)
//!
//! Q and R are differences, and noise makes them negative; one innovation cannot separate Q from R, nor q from r.

use nalgebra::{Matrix2, Vector2, matrix, vector};

use crate::Real;
use crate::api::real::{GRAVITY, PI, cos, pow, sin};
use crate::printed::usable;

/// Method for the noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoiseRule {
    /// Constant noise as given.
    Fixed,
    /// Adapted as printed, with A P Aᵀ in place of the term whose dimension does not fit.
    Printed,
    /// Adapted exactly as printed: the number is subtracted from every element.
    Literal,
}

/// Initial values of the filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Told {
    /// Variance of wheel speed, m²/s².
    pub r: Real,
    /// Process noise of [v, θ] per second.
    pub q: [Real; 2],
    /// Standard deviation of θ at the start, deg.
    pub grade0_sd_deg: Real,
    /// Forgetting factor κ or b.
    pub fading: Real,
    /// Method for the noise.
    pub noise: NoiseRule,
    /// sin θ ≈ θ, cos θ ≈ 1.
    pub small_angles: bool,
}

/// The force balance of one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Balance {
    /// Traction at the rims, N.
    pub traction_n: Real,
    /// Total mass, kg, of any value.
    pub mass_kg: Real,
    /// Rotating masses as the print has them, kg.
    pub rotating_mass_kg: Real,
    /// sgn(v) μ.
    pub resistance: Real,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct EkfState {
    x: Vector2<Real>,
    P: Matrix2<Real>,
    q: Vector2<Real>,
    /// Process noise of one step; `None` until the first step gives its length.
    Q: Option<Matrix2<Real>>,
    r: Real,
    R: Real,
    k: u32,
    innovation: Real,
    nis: Real,
}

/// The filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlopeEkf {
    told: Told,
    now: EkfState,
    start: EkfState,
    started: bool,
    breakdowns: u32,
    steps: u32,
    indefinite: u32,
}

impl SlopeEkf {
    /// Level at the start.
    pub fn new(told: Told) -> Self {
        let sd = told.grade0_sd_deg * PI / 180.0;
        let start = EkfState {
            x: Vector2::zeros(),
            P: Matrix2::from_diagonal(&vector![told.r, sd * sd]),
            q: Vector2::zeros(),
            Q: None,
            r: 0.0,
            R: told.r,
            k: 0,
            innovation: 0.0,
            nis: 0.0,
        };
        Self {
            told,
            now: start,
            start,
            started: false,
            breakdowns: 0,
            steps: 0,
            indefinite: 0,
        }
    }

    /// Takes a wheel speed, `dt` after the last one.
    pub fn step(&mut self, balance: &Balance, wheel_speed_mps: Real, dt: Real) {
        if !self.started {
            self.now.x.x = wheel_speed_mps;
            self.started = true;
        }
        let next = self.next(balance, wheel_speed_mps, dt);
        let numbers = next.x.iter().chain(&next.P).chain(&next.q);
        if usable(numbers.chain([&next.r, &next.R])) && next.nis.is_finite() {
            self.now = next;
        } else {
            self.now = self.start;
            self.now.x.x = wheel_speed_mps;
            self.breakdowns = self.breakdowns.saturating_add(1);
        }
        self.steps = self.steps.saturating_add(1);
        if self.noise_is_indefinite() {
            self.indefinite = self.indefinite.saturating_add(1);
        }
    }

    /// f(x) of eq. 24 and its Jacobian.
    fn transition(&self, balance: &Balance, dt: Real) -> (Vector2<Real>, Matrix2<Real>) {
        let (v, theta) = (self.now.x.x, self.now.x.y);
        let (sine, cosine) = if self.told.small_angles {
            (theta, 1.0)
        } else {
            (sin(theta), cos(theta))
        };
        let by_sine = if self.told.small_angles { 0.0 } else { sine };
        let weight = balance.mass_kg * GRAVITY;
        let inertia = balance.mass_kg + balance.rotating_mass_kg;
        let rate = (balance.traction_n - weight * (sine + balance.resistance * cosine)) / inertia;
        let by_theta = -weight * (cosine - balance.resistance * by_sine) / inertia;
        (
            vector![v + dt * rate, theta],
            matrix![1.0, dt * by_theta; 0.0, 1.0],
        )
    }

    fn next(&self, balance: &Balance, z: Real, dt: Real) -> EkfState {
        let EkfState {
            P, q, r, R, k, Q, ..
        } = self.now;
        let [q_v, q_theta] = self.told.q;
        let Q = Q.unwrap_or(Matrix2::from_diagonal(&vector![q_v * dt, q_theta * dt]));
        let (carried, A) = self.transition(balance, dt);
        let carried_P = A * P * A.transpose();
        let (x_prior, P_prior) = (carried + q, carried_P + Q);
        let S = P_prior.m11 + R;
        let innovation = z - x_prior.x - r;
        let K = P_prior.column(0) / S;
        let x = x_prior + K * innovation;
        let P = P_prior - K * P_prior.row(0);

        let k = k.saturating_add(1);
        let d = (1.0 - self.told.fading) / (1.0 - pow(self.told.fading, k as Real));
        let moved = K * innovation;
        let found = moved * moved.transpose() + P;
        let found = match self.told.noise {
            NoiseRule::Literal => found.add_scalar(-P_prior.m11),
            _ => found - carried_P,
        };
        let mut next = EkfState {
            x,
            P,
            Q: Some(Q),
            k,
            innovation,
            nis: innovation * innovation / S,
            ..self.now
        };
        if self.told.noise != NoiseRule::Fixed {
            next.q = q * (1.0 - d) + (x - carried) * d;
            next.Q = Some(Q * (1.0 - d) + found * d);
            next.r = r * (1.0 - d) + (z - x_prior.x) * d;
            next.R = R * (1.0 - d) + (innovation * innovation - P_prior.m11) * d;
        }
        next
    }

    fn noise_is_indefinite(&self) -> bool {
        let Q = self.now.Q.unwrap_or(Matrix2::zeros());
        self.now.R <= 0.0 || Q.m11 < 0.0 || Q.m22 < 0.0 || Q.determinant() < -1e-30
    }

    /// [v, θ] and their covariance.
    pub fn belief(&self) -> (Vector2<Real>, Matrix2<Real>) {
        (self.now.x, self.now.P)
    }

    /// Innovation and normalised innovation squared of the last step.
    pub fn innovation(&self) -> (Real, Real) {
        (self.now.innovation, self.now.nis)
    }

    /// Number of breakdowns, and share of all steps in which R was not positive or Q not positive semi-definite.
    pub fn failures(&self) -> (Real, Real) {
        let share = Real::from(self.indefinite) / Real::from(self.steps.max(1));
        (Real::from(self.breakdowns), share)
    }
}
