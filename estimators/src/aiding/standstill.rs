//! Standstill, which measures the gyro's biases: a vehicle that stands does not turn, so that the gyro reads them
//! (zero-rate update).

use nalgebra::SVector;

use crate::Real;
use crate::aiding::Aid;
use crate::models::attitude::{GYRO_X, GYRO_Y, GYRO_Z, N};

/// Noise of the gyro with the vibration of a standing vehicle, rad/√s.
pub const STANDING_NOISE: Real = 3e-4;

/// The measurement by one axis of the gyro.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Standstill {
    bias: usize,
    rate_radps: Real,
    dt: Real,
}

impl Standstill {
    /// The measurements by the three axes of a gyro that reads `rate_radps` over `dt` seconds.
    pub fn by_axis(rate_radps: [Real; 3], dt: Real) -> [Self; 3] {
        let [p, q, r] = rate_radps;
        [(GYRO_X, p), (GYRO_Y, q), (GYRO_Z, r)].map(|(bias, rate_radps)| Self {
            bias,
            rate_radps,
            dt,
        })
    }
}

impl Aid<N> for Standstill {
    fn innovation(&self, x: &SVector<Real, N>) -> Real {
        self.rate_radps - self.h(x)
    }

    fn h(&self, x: &SVector<Real, N>) -> Real {
        x[self.bias]
    }

    #[allow(
        clippy::indexing_slicing,
        reason = "indices of states are constants below N"
    )]
    fn H(&self, _: &SVector<Real, N>) -> SVector<Real, N> {
        let mut h = SVector::<Real, N>::zeros();
        h[self.bias] = 1.0;
        h
    }

    fn R(&self) -> Real {
        STANDING_NOISE * STANDING_NOISE / self.dt
    }
}
