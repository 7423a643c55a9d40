//! Standstill, which measures the gyro's biases: a vehicle that stands does not turn, so that the gyro reads them
//! (zero-rate update).

use nalgebra::SVector;

use crate::Real;
use crate::aiding::Aid;
use crate::models::attitude::{GYRO_X, GYRO_Y, GYRO_Z, N};
use crate::tuning::STANDSTILL;

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
        STANDSTILL.noise * STANDSTILL.noise / self.dt
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::aiding::{GateRule, fuse};
    use crate::detect::control::Control;
    use crate::filters::gaussian::Gaussian;

    /// Standing for T seconds is to read each bias with a noise of 3e-4 rad/√s: the information about it grows by
    /// T/9e-8, whatever the rate of the samples, and the estimate is the mean of prior and reading by information.
    #[test]
    fn a_stand_reads_the_biases_by_its_length() {
        let (read, prior) = ([0.002, -0.003, 0.001], 1e-3);
        for dt in [0.01, 0.05] {
            let mut belief = Gaussian::independent(SVector::zeros(), SVector::zeros());
            let axes = [GYRO_X, GYRO_Y, GYRO_Z];
            for bias in axes {
                belief.set_independent(bias, 0.0, prior * prior);
            }
            for _ in 0..(2.0 / dt + 0.5) as usize {
                for axis in Standstill::by_axis(read, dt) {
                    let _ = fuse(&mut belief, Control::New(axis), GateRule::Open);
                }
            }
            let information = 1.0 / (prior * prior) + 2.0 / 9e-8;
            for (bias, read) in axes.into_iter().zip(read) {
                let found = belief.P[(bias, bias)] * information;
                assert!((found - 1.0).abs() < 1e-6, "{found}");
                let mean = read * 2.0 / 9e-8 / information;
                assert!((belief.x[bias] / mean - 1.0).abs() < 1e-6);
            }
        }
    }
}
