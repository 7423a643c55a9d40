//! Specific force across the body, which measures its roll: mean over a window
//! ([`ForceWindow`](super::force_window::ForceWindow)).
//!
//! f_y = v r + g sin φ cos θ + b_y + (l_x Δr + l_z Δp)/T
//!
//! with r the rate about z without the gyro's bias, Δ the change of the body rates over the window of T seconds, behind
//! a low-pass of 20 ms, and l_x, l_z how far the IMU is ahead of and below the unit's middle. Without l_x Δr the roll
//! is thrown by 0.4° at both ends of each bend, and by the turn the pitch with it.

use nalgebra::SVector;

use crate::Real;
use crate::aiding::Aid;
use crate::api::real::{GRAVITY, cos, sin};
use crate::models::attitude::{BIAS_Y, GYRO_Z, N, PHI, THETA, V};

/// The measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lateral {
    /// Mean of f_y less its prediction without b_y, each sample with the state of its time, m/s².
    pub residual_mps2: Real,
    /// Rate about z at the end of the window as the gyro reads it, rad/s.
    pub yaw_rate_radps: Real,
    /// (l_x Δr + l_z Δp)/T, m/s².
    pub turned_mps2: Real,
    /// Variance of the mean, m²/s⁴.
    pub variance: Real,
}

impl Aid<N> for Lateral {
    fn innovation(&self, x: &SVector<Real, N>) -> Real {
        self.residual_mps2 - x[BIAS_Y]
    }

    fn h(&self, x: &SVector<Real, N>) -> Real {
        x[V] * (self.yaw_rate_radps - x[GYRO_Z])
            + GRAVITY * sin(x[PHI]) * cos(x[THETA])
            + x[BIAS_Y]
            + self.turned_mps2
    }

    #[allow(
        clippy::indexing_slicing,
        reason = "indices of states are constants below N"
    )]
    fn H(&self, x: &SVector<Real, N>) -> SVector<Real, N> {
        let mut h = SVector::<Real, N>::zeros();
        h[V] = self.yaw_rate_radps - x[GYRO_Z];
        h[GYRO_Z] = -x[V];
        h[THETA] = -GRAVITY * sin(x[PHI]) * sin(x[THETA]);
        h[PHI] = GRAVITY * cos(x[PHI]) * cos(x[THETA]);
        h[BIAS_Y] = 1.0;
        h
    }

    fn R(&self) -> Real {
        self.variance
    }
}
