//! Specific force across the rail as measurements of the attitude filter: roll by f_y, and by f_z the vertical bias on the level and with it
//! the pitch on a slope (|f| = g).
//!
//! Over windows of T = 50 ms, of the means of all:
//!
//! f_y = v r + g sin φ cos θ + b_y + (l_x Δr + l_z Δp)/T,  f_z = −v q + g cos φ cos θ + b_z + l_z q² − l_x Δq/T
//!
//! with Δ the change of the body rates, behind a low-pass of 20 ms, over the window. Without l_x Δr the roll is thrown by 0.4° at both ends
//! of each bend, and by the turn the pitch with it. Residuals beyond three standard deviations are deweighted (Huber 1964).
//!
//! The noise of a window is that of the sheet or that seen, whichever is larger: an accelerometer that is shaken tells less than its sheet. It is
//! learnt from the means of windows and not from samples, so that bounce, whose mean is small, counts for little.

use nalgebra::{SVector, Vector3};

use super::params::AttitudeParams;
use super::{BIAS_Y, BIAS_Z, GYRO_Y, GYRO_Z, Lever, N, PHI, THETA, V};
use crate::Real;
use crate::api::aid::{AidOutcome, AidStatus, Rejection};
use crate::api::real::{GRAVITY, cos, sin, sqrt};
use crate::api::snapshot::state;
use crate::filters::gaussian::Gaussian;
use crate::preprocess::noise_learning::NoiseLearning;

/// Length of a window, s, and low-pass of the rates in the lever's term, s.
const WINDOW_S: Real = 0.05;
const RATE_LAG_S: Real = 0.02;
/// Standard deviations beyond which a residual is deweighted.
const HUBER_SD: Real = 3.0;
/// Factor on the noise of f_y: impacts of the guide wheels.
const LATERAL_NOISE_FACTOR: Real = 25.0;
/// Velocity random walk that is assumed until that of the instrument has been seen, m/s/√s: of a shaken robot.
const UNSEEN_WALK: Real = 0.1;

/// Measurements across the rail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GravityAiding {
    random_walk: Real,
    lateral_sd_mps2: Real,
    vertical_factor: Real,
    learns: bool,
    noise: [NoiseLearning; 4],
    sums: [Real; 4],
    length_s: Real,
    rates: Option<[Vector3<Real>; 2]>,
}

impl GravityAiding {
    /// From the sensor sheet; with `learns` the noise is never below that seen.
    pub fn new(params: &AttitudeParams, learns: bool) -> Self {
        Self {
            random_walk: params.velocity_random_walk,
            lateral_sd_mps2: params.lateral_force_sd_mps2,
            vertical_factor: params.force_noise_factor,
            learns,
            noise: [NoiseLearning::of_acceleration(); 4],
            sums: [0.0; 4],
            length_s: 0.0,
            rates: None,
        }
    }

    /// Velocity random walk seen along the body, m/s/√s; 0 if it is not learnt, or there are no windows for want of a gyro.
    pub fn seen_walk(&self) -> Real {
        let [forward, ..] = &self.noise;
        self.walk(forward)
    }

    /// Angle random walk seen about y, rad/√s; 0 if it is not learnt.
    pub fn seen_turn_walk(&self) -> Real {
        let [.., turn] = &self.noise;
        if self.learns {
            turn.sd().map_or(0.0, |sd| sd * sqrt(WINDOW_S))
        } else {
            0.0
        }
    }

    fn walk(&self, noise: &NoiseLearning) -> Real {
        if !self.learns || self.rates.is_none() {
            return 0.0;
        }
        noise.sd().map_or(UNSEEN_WALK, |sd| sd * sqrt(WINDOW_S))
    }

    /// Variance of the mean of a window of `T` seconds on axis 1 (left) or 2 (up): `factor` times that of the sheet, or that seen.
    fn variance(&self, axis: usize, factor: Real, T: Real) -> Real {
        let seen = self.noise.get(axis).map_or(0.0, |noise| self.walk(noise));
        (factor * self.random_walk * self.random_walk).max(seen * seen) / T
    }

    /// Takes one sample; at the end of a window corrects the belief and tells what became of f_y and f_z.
    pub fn step(
        &mut self,
        belief: &mut Gaussian<N>,
        force: Vector3<Real>,
        rate: Vector3<Real>,
        lever: Lever,
        vertical: bool,
        dt: Real,
    ) -> Option<[AidStatus; 2]> {
        let [mut now, first] = self.rates.unwrap_or([rate; 2]);
        now += (rate - now) * (dt / (RATE_LAG_S + dt));
        self.rates = Some([now, first]);
        let x = &belief.x;
        let g_phi = GRAVITY * cos(x[THETA]);
        let [x_sum, y, z, turn_sum] = &mut self.sums;
        let q = rate.y;
        *x_sum += force.x * dt;
        *turn_sum += q * dt;
        *y += (force.y - x[V] * rate.z - g_phi * sin(x[PHI])) * dt;
        *z += (force.z + x[V] * q - g_phi * cos(x[PHI]) - lever.below_m * q * q) * dt;
        self.length_s += dt;
        if self.length_s < WINDOW_S - 1e-6 {
            return None;
        }
        let (T, turn) = (self.length_s, now - first);
        let [forward, y, z, nod] = self.sums.map(|sum| sum / T);
        (self.sums, self.length_s, self.rates) = ([0.0; 4], 0.0, Some([now, now]));
        let lateral = y - (lever.ahead_m * turn.z + lever.below_m * turn.x) / T;
        let upward = z + lever.ahead_m * turn.y / T;
        for (noise, mean) in self.noise.iter_mut().zip([forward, lateral, upward, nod]) {
            noise.observe(mean, T);
        }
        let side = self.lateral_sd_mps2;
        let lateral = fuse_lateral(
            belief,
            lateral,
            rate.z,
            self.variance(1, LATERAL_NOISE_FACTOR, T) + side * side,
        );
        let upward = match vertical {
            true => {
                let R = self.variance(2, self.vertical_factor, T);
                fuse_vertical(belief, upward, [q, lever.below_m], R)
            }
            false => AidStatus::default(),
        };
        Some([lateral, upward])
    }
}

/// `residual` is f_y without its bias less the prediction.
fn fuse_lateral(belief: &mut Gaussian<N>, residual: Real, yaw_rate: Real, R: Real) -> AidStatus {
    let x = belief.x;
    let mut h = SVector::<Real, N>::zeros();
    h[V] = yaw_rate;
    h[GYRO_Z] = -x[V];
    h[THETA] = -GRAVITY * sin(x[PHI]) * sin(x[THETA]);
    h[PHI] = GRAVITY * cos(x[PHI]) * cos(x[THETA]);
    h[BIAS_Y] = 1.0;
    huber(belief, residual - x[BIAS_Y], &h, R)
}

/// `residual` is f_z without its bias less the prediction.
fn fuse_vertical(
    belief: &mut Gaussian<N>,
    residual: Real,
    [pitch_rate, below_m]: [Real; 2],
    R: Real,
) -> AidStatus {
    let x = belief.x;
    let mut h = SVector::<Real, N>::zeros();
    h[V] = -pitch_rate;
    h[GYRO_Y] = x[V] - 2.0 * below_m * pitch_rate;
    h[THETA] = -GRAVITY * cos(x[PHI]) * sin(x[THETA]);
    h[PHI] = -GRAVITY * sin(x[PHI]) * cos(x[THETA]);
    h[BIAS_Z] = 1.0;
    huber(belief, residual - x[BIAS_Z], &h, R)
}

/// Fuses with a noise that makes the innovation no more than [`HUBER_SD`].
fn huber(belief: &mut Gaussian<N>, y: Real, h: &SVector<Real, N>, R: Real) -> AidStatus {
    let S = h.dot(&(belief.P * h)) + R;
    let ratio = y * y / (HUBER_SD * HUBER_SD * S).max(Real::MIN_POSITIVE);
    let inflated = R + (ratio - 1.0).max(0.0) * S;
    let outcome = match belief.update_scalar(y, h, inflated) {
        None => AidOutcome::Rejected(Rejection::Numeric),
        Some(()) if ratio > 1.0 => AidOutcome::Deweighted,
        Some(()) => AidOutcome::Fused,
    };
    AidStatus {
        innovation: y,
        innovation_variance: S,
        test_ratio: ratio,
        outcome,
    }
}

state!(GravityAiding { noise, sums, length_s, rates; random_walk, lateral_sd_mps2, vertical_factor, learns });
