//! Gyro bias, learnt while the vehicle stands.

use crate::Real;
use crate::api::real::sqrt;
use crate::api::snapshot::state;

/// Standing for so long, by the wheels, before the gyro is taken to read its bias, s: a load swings on.
const QUIET_S: Real = 1.0;

/// Noise of the gyro with the vibration of a standing vehicle, rad/√s: three to ten times the angular random walk of
/// MEMS sheets.
const NOISE_RAD_PER_ROOT_S: Real = 1e-3;

/// Random walk of the bias, rad/s/√s: 0.05 °/s in ten minutes.
const DRIFT: Real = 4e-5;

/// Largest bias, rad/s: 9 °/s. What turns faster does not stand, or is no gyro in rad/s.
const MAX_BIAS_RADPS: Real = 0.15;

/// Zero-rate calibration of `N` gyro axes: a scalar Kalman filter for each bias, all with one variance, updated at
/// standstill.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GyroCalibration<const N: usize> {
    bias: [Real; N],
    variance: Real,
    most: Real,
    quiet_s: Real,
}

impl<const N: usize> GyroCalibration<N> {
    /// Builds the gyro calibration with the standard deviation of the biases at switch-on, rad/s.
    pub fn new(prior_sd_radps: Real) -> Self {
        let most = prior_sd_radps * prior_sd_radps;
        Self {
            bias: [0.0; N],
            variance: most,
            most,
            quiet_s: 0.0,
        }
    }

    /// One step of `dt` seconds; `rates` where all axes have a new sample, `period_s` after the one before.
    pub fn step(&mut self, standing: bool, rates: Option<[Real; N]>, period_s: Real, dt: Real) {
        self.variance = (self.variance + DRIFT * DRIFT * dt).min(self.most);
        self.quiet_s = if standing { self.quiet_s + dt } else { 0.0 };
        let Some(rates) = rates.filter(|_| self.quiet_s > QUIET_S) else {
            return;
        };
        if rates.iter().any(|rate| rate.abs() > MAX_BIAS_RADPS) {
            return;
        }
        let noise = NOISE_RAD_PER_ROOT_S * NOISE_RAD_PER_ROOT_S / period_s.max(1e-4);
        let gain = self.variance / (self.variance + noise);
        for (bias, rate) in self.bias.iter_mut().zip(rates) {
            *bias += gain * (rate - *bias);
        }
        self.variance *= 1.0 - gain;
    }

    /// Biases, rad/s.
    pub fn bias_radps(&self) -> [Real; N] {
        self.bias
    }

    /// Their standard deviation, rad/s.
    pub fn sd_radps(&self) -> Real {
        sqrt(self.variance)
    }
}

state!(@[const N: usize] GyroCalibration<N> { bias, variance, quiet_s; most } where |this| this.variance >= 0.0);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    #[test]
    fn a_bias_of_degrees_is_found_at_standstill_and_kept_on_the_way() {
        let (dt, bias) = (0.01, [0.035, -0.02]);
        let mut calibration = GyroCalibration::new(0.03);
        let mut random = Random::new(98);
        let mut run = |standing: bool, rate: Real, steps: usize| {
            for _ in 0..steps {
                let rates = bias.map(|b| b + rate + 1e-3 * random.normal());
                calibration.step(standing, Some(rates), dt, dt);
            }
            calibration
        };
        assert_eq!(run(false, 0.1, 1000).bias_radps(), [0.0; 2]);
        let found = run(true, 0.0, 600);
        for (found, bias) in found.bias_radps().into_iter().zip(bias) {
            assert!((found - bias).abs() < 3.0 * 5e-4, "{found}");
        }
        assert!(
            (4e-4..6e-4).contains(&found.sd_radps()),
            "{}",
            found.sd_radps()
        );
        let later = run(false, 0.1, 6000);
        assert_eq!(later.bias_radps(), found.bias_radps());
        assert!(later.sd_radps() > found.sd_radps());
    }

    #[test]
    fn a_gyro_in_degrees_per_second_is_not_calibrated_away() {
        let mut calibration = GyroCalibration::new(0.03);
        for _ in 0..1000 {
            calibration.step(true, Some([1.5, 0.0]), 0.01, 0.01);
        }
        assert_eq!(calibration.bias_radps(), [0.0; 2]);
    }

    #[test]
    fn a_gyro_told_to_be_good_stays_as_it_is() {
        let mut calibration = GyroCalibration::new(2.4e-6);
        let mut random = Random::new(99);
        for _ in 0..1000 {
            calibration.step(true, Some([1e-3 * random.normal()]), 0.01, 0.01);
        }
        assert!(calibration.bias_radps()[0].abs() < 1e-6);
    }
}
