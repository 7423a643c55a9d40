//! Errors of an uncalibrated IMU, which the model of the attitude filter leaves out.

use crate::Real;
use crate::api::real::GRAVITY;
use crate::filters::gaussian::Gaussian;
use crate::models::attitude::{BIAS_X, N, PHI, THETA};
use crate::tuning::{CALIBRATION, TIMES};

/// Calibration of an IMU.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// 0 for a calibrated instrument, 1 for an uncalibrated instrument.
    doubt: Real,
    accel_bias_sd_mps2: Real,
}

impl Calibration {
    /// Builds the calibration of an instrument with these standard deviations of the biases of accelerometer, m/s², and
    /// gyro, rad/s.
    pub fn new(bias_sd: [Real; 2]) -> Self {
        let [accel_bias_sd_mps2, _] = bias_sd;
        let [calibrated_sd, doubted_sd] = CALIBRATION.calibrated_sd;
        let largest_sd = bias_sd.iter().fold(0.0, |most: Real, sd| most.max(*sd));
        let doubt = (largest_sd - calibrated_sd) / (doubted_sd - calibrated_sd);
        Self {
            doubt: doubt.clamp(0.0, 1.0),
            accel_bias_sd_mps2,
        }
    }

    /// Returns the doubt in the calibration: 0 for a calibrated instrument, 1 for an uncalibrated instrument.
    pub fn doubted(&self) -> Real {
        self.doubt
    }

    /// Returns the variance of a measurement that depends on the calibration; `None` if the measurement is not used.
    pub fn trusted(&self, variance: Real) -> Option<Real> {
        let trust = 1.0 - self.doubt;
        (trust > 0.0).then(|| variance / (trust * trust))
    }

    /// Lower limit of the reported standard deviation of the pitch, rad. For an uncalibrated IMU this is the
    /// accelerometer's bias over g, because askew axes read a turn in a bend as one in pitch, which the covariance does
    /// not contain.
    pub fn least_pitch_sd_rad(&self) -> Real {
        self.doubt * self.accel_bias_sd_mps2 / GRAVITY
    }

    /// Widens the belief about an uncalibrated IMU after it has pitched by `turn_rad` at a yaw rate. A scale error
    /// changes the bias with the grade; otherwise the change of cos θ on a slope would pass for a measurement of the
    /// bias. Askew axes read a share of the yaw rate as rates of pitch and roll.
    #[allow(
        clippy::indexing_slicing,
        reason = "indices of states are constants below N"
    )]
    pub fn doubt(&self, belief: &mut Gaussian<N>, turn_rad: Real, yaw_rate_radps: Real, dt: Real) {
        if self.doubt == 0.0 {
            return;
        }
        let scale = CALIBRATION.scale_sd * GRAVITY;
        belief.P[(BIAS_X, BIAS_X)] +=
            self.doubt * scale * scale * CALIBRATION.ramp_rad * turn_rad.abs();
        let askew = CALIBRATION.askew_rad * yaw_rate_radps;
        for angle in [THETA, PHI] {
            belief.P[(angle, angle)] += self.doubt * askew * askew * TIMES.pause_s * dt;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::SVector;

    /// Growth of the standard deviations of bias, pitch and roll while an instrument whose accelerometer has a bias of
    /// `bias_sd` m/s² pitches by `turn_rad` in all and turns at `yaw_rate` rad/s for `seconds`.
    fn grown(bias_sd: Real, turn_rad: Real, yaw_rate: Real, seconds: Real) -> [Real; 3] {
        let calibration = Calibration::new([bias_sd, 0.0]);
        let mut belief = Gaussian::independent(SVector::zeros(), SVector::zeros());
        let steps = 1_000;
        for _ in 0..steps {
            let part = 1.0 / steps as Real;
            calibration.doubt(&mut belief, turn_rad * part, yaw_rate, seconds * part);
        }
        [BIAS_X, THETA, PHI].map(|i| belief.P[(i, i)].sqrt())
    }

    /// A scale that is wrong by 0.75 % reads g sin θ wrong by as much: over a ramp of 0.2 rad the bias is another by
    /// 0.0075 g 0.2. Axes askew by 0.025 rad read, in a bend of 2 s at 0.4 rad/s, 0.025 · 0.4 · 2 rad of pitch and of
    /// roll that are none. Up or down, left or right is the same.
    #[test]
    fn scale_counts_as_one_error_over_a_ramp_and_axes_as_one_over_a_bend() {
        for sign in [1.0, -1.0] {
            let [bias, pitch, roll] = grown(0.1, sign * 0.2, sign * 0.4, 2.0);
            assert!(
                (bias / (0.0075 * GRAVITY * 0.2) - 1.0).abs() < 1e-6,
                "{bias}"
            );
            assert!((pitch / (0.025 * 0.4 * 2.0) - 1.0).abs() < 1e-6, "{pitch}");
            assert_eq!(pitch, roll);
        }
    }

    /// An instrument of 0.03 m/s² is calibrated: nothing is doubted, and what rests on the calibration is trusted. One
    /// of 0.06 m/s² is not. Half-way between the two, half of the variances is added, and the measurement has four
    /// times its variance.
    #[test]
    fn between_a_calibrated_instrument_and_another_the_doubt_is_in_proportion() {
        let at = |sd: Real| Calibration::new([sd, 0.0]);
        assert_eq!(grown(0.03, 0.2, 0.4, 3.0), [0.0; 3]);
        assert_eq!(
            (at(0.02).doubted(), at(0.02).trusted(2.0)),
            (0.0, Some(2.0))
        );
        assert_eq!((at(0.2).doubted(), at(0.2).trusted(2.0)), (1.0, None));
        let (half, whole) = (grown(0.045, 0.2, 0.4, 3.0), grown(0.06, 0.2, 0.4, 3.0));
        for (half, whole) in half.iter().zip(whole) {
            assert!((half * half / (whole * whole) - 0.5).abs() < 1e-6);
        }
        assert!((at(0.045).trusted(2.0).unwrap() - 8.0).abs() < 1e-6);
        // the bias over g is the least that the pitch is uncertain by
        assert_eq!(at(0.02).least_pitch_sd_rad(), 0.0);
        assert!((at(0.0981).least_pitch_sd_rad() - 0.01).abs() < 1e-6);
        // a gyro that is not calibrated is doubted as well
        assert_eq!(Calibration::new([0.0, 0.2]).doubted(), 1.0);
    }
}
