//! Specific force upwards, which measures its own bias on the level and with it the pitch on a slope (|f| = g): mean
//! over a window ([`ForceWindow`](super::force_window::ForceWindow)).
//!
//! f_z = −v q + g cos φ cos θ + b_z + l_z q² − l_x Δq/T
//!
//! with q the rate about y without the gyro's bias; the rest is as in [`lateral`](super::lateral).

use nalgebra::SVector;

use crate::Real;
use crate::aiding::Aid;
use crate::api::real::{GRAVITY, cos, sin};
use crate::models::attitude::{BIAS_Z, GYRO_Y, N, PHI, THETA, V};

/// The measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertical {
    /// Mean of f_z less its prediction without b_z, each sample with the state of its time, m/s².
    pub residual_mps2: Real,
    /// Rate about y at the end of the window as the gyro reads it, rad/s.
    pub pitch_rate_radps: Real,
    /// −l_x Δq/T, m/s².
    pub nodded_mps2: Real,
    /// Distance of the IMU below the unit's middle, m.
    pub below_m: Real,
    /// Variance of the mean, m²/s⁴.
    pub variance: Real,
}

impl Aid<N> for Vertical {
    fn innovation(&self, x: &SVector<Real, N>) -> Real {
        self.residual_mps2 - x[BIAS_Z]
    }

    fn h(&self, x: &SVector<Real, N>) -> Real {
        let q = self.pitch_rate_radps - x[GYRO_Y];
        GRAVITY * cos(x[PHI]) * cos(x[THETA]) - x[V] * q
            + x[BIAS_Z]
            + self.below_m * q * q
            + self.nodded_mps2
    }

    #[allow(
        clippy::indexing_slicing,
        reason = "indices of states are constants below N"
    )]
    fn H(&self, x: &SVector<Real, N>) -> SVector<Real, N> {
        let q = self.pitch_rate_radps - x[GYRO_Y];
        let mut h = SVector::<Real, N>::zeros();
        h[V] = -q;
        h[GYRO_Y] = x[V] - 2.0 * self.below_m * q;
        h[THETA] = -GRAVITY * cos(x[PHI]) * sin(x[THETA]);
        h[PHI] = -GRAVITY * sin(x[PHI]) * cos(x[THETA]);
        h[BIAS_Z] = 1.0;
        h
    }

    fn R(&self) -> Real {
        self.variance
    }
}
