//! Means of the specific force across the body, and of what the state predicts of it, over windows of 50 ms.
//!
//! The noise of a window is that of the sheet or that seen, whichever is larger: an accelerometer that is shaken reads
//! less than its sheet promises. It is learnt from the means of windows and not from samples, so that bounce, whose
//! mean is small, counts for little.

use nalgebra::{SVector, Vector3};

use crate::Real;
use crate::aiding::lateral::Lateral;
use crate::aiding::vertical::Vertical;
use crate::api::real::{GRAVITY, sqrt};
use crate::api::snapshot::state;
use crate::models::attitude::{GYRO_X, GYRO_Y, GYRO_Z, Lever, N, V};
use crate::preprocess::noise_learning::NoiseLearning;

/// Length of a window, s.
const WINDOW_S: Real = 0.05;
/// Low-pass of the body rates whose change over a window is a force on the lever, s.
const RATE_LAG_S: Real = 0.02;
/// Factor on the variance of f_y: impacts of the guide wheels.
const LATERAL_NOISE_FACTOR: Real = 25.0;
/// Velocity random walk that is assumed until that of the instrument has been seen, m/s/√s: of a shaken robot.
const UNSEEN_WALK: Real = 0.1;

/// Noise of the specific force across the body, from the sensor sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceNoise {
    /// Velocity random walk, m/s/√s.
    pub random_walk: Real,
    /// Standard deviation of the model of f_y, m/s².
    pub lateral_sd_mps2: Real,
    /// Factor on the variance of f_z: bounce.
    pub vertical_factor: Real,
    /// True if the noise is never smaller than the noise seen in the samples.
    pub learns: bool,
}

/// The window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceWindow {
    noise: ForceNoise,
    seen: [NoiseLearning; 4],
    sums: [Real; 4],
    length_s: Real,
    rates: Option<[Vector3<Real>; 2]>,
}

impl ForceWindow {
    /// Starts without samples.
    pub fn new(noise: ForceNoise) -> Self {
        Self {
            noise,
            seen: [NoiseLearning::of_acceleration(); 4],
            sums: [0.0; 4],
            length_s: 0.0,
            rates: None,
        }
    }

    /// Velocity random walk seen along the body, m/s/√s; 0 if it is not learnt, or there are no windows for want of a
    /// gyro.
    pub fn seen_walk(&self) -> Real {
        let [forward, ..] = &self.seen;
        self.walk(forward)
    }

    /// Angle random walk seen about y, rad/√s; 0 if it is not learnt.
    pub fn seen_turn_walk(&self) -> Real {
        let [.., turn] = &self.seen;
        if self.noise.learns {
            turn.sd().map_or(0.0, |sd| sd * sqrt(WINDOW_S))
        } else {
            0.0
        }
    }

    fn walk(&self, seen: &NoiseLearning) -> Real {
        if !self.noise.learns || self.rates.is_none() {
            return 0.0;
        }
        seen.sd().map_or(UNSEEN_WALK, |sd| sd * sqrt(WINDOW_S))
    }

    /// Variance of the mean of a window of `T` seconds: `factor` times that of the sheet, or that `seen`.
    fn variance(&self, seen: &NoiseLearning, factor: Real, T: Real) -> Real {
        let (sheet, seen) = (self.noise.random_walk, self.walk(seen));
        (factor * sheet * sheet).max(seen * seen) / T
    }

    /// Takes one sample and the state with the sines and cosines of its pitch and roll; at the end of a window the
    /// measurements across and up.
    pub fn step(
        &mut self,
        (x, sin_cos): (&SVector<Real, N>, [[Real; 2]; 2]),
        force: [Real; 3],
        rate: [Real; 3],
        lever: Lever,
        dt: Real,
    ) -> Option<(Lateral, Vertical)> {
        let [[_, cos_theta], [sin_phi, cos_phi]] = sin_cos;
        let raw = Vector3::from(rate);
        let rate = raw - Vector3::new(x[GYRO_X], x[GYRO_Y], x[GYRO_Z]);
        let [mut now, first] = self.rates.unwrap_or([rate; 2]);
        now += (rate - now) * (dt / (RATE_LAG_S + dt));
        self.rates = Some([now, first]);
        let [fx, fy, fz] = force;
        let g_phi = GRAVITY * cos_theta;
        let [x_sum, y, z, turn_sum] = &mut self.sums;
        let q = rate.y;
        *x_sum += fx * dt;
        *turn_sum += q * dt;
        *y += (fy - x[V] * rate.z - g_phi * sin_phi) * dt;
        *z += (fz + x[V] * q - g_phi * cos_phi - lever.below_m * q * q) * dt;
        self.length_s += dt;
        if self.length_s < WINDOW_S - 1e-6 {
            return None;
        }
        let (T, turn) = (self.length_s, now - first);
        let [forward, y, z, nod] = self.sums.map(|sum| sum / T);
        (self.sums, self.length_s, self.rates) = ([0.0; 4], 0.0, Some([now, now]));
        let turned = (lever.ahead_m * turn.z + lever.below_m * turn.x) / T;
        let nodded = -lever.ahead_m * turn.y / T;
        let (across, up) = (y - turned, z - nodded);
        for (seen, mean) in self.seen.iter_mut().zip([forward, across, up, nod]) {
            seen.observe(mean, T);
        }
        let [_, seen_across, seen_up, _] = &self.seen;
        let side = self.noise.lateral_sd_mps2;
        Some((
            Lateral {
                residual_mps2: across,
                yaw_rate_radps: raw.z,
                turned_mps2: turned,
                variance: self.variance(seen_across, LATERAL_NOISE_FACTOR, T) + side * side,
            },
            Vertical {
                residual_mps2: up,
                pitch_rate_radps: raw.y,
                nodded_mps2: nodded,
                below_m: lever.below_m,
                variance: self.variance(seen_up, self.noise.vertical_factor, T),
            },
        ))
    }
}

state!(ForceWindow { seen, sums, length_s, rates; noise });
