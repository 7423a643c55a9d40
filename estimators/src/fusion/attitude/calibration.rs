//! Errors of an IMU that is not calibrated, which the model of the attitude filter leaves out.

use crate::Real;
use crate::api::real::GRAVITY;
use crate::filters::gaussian::Gaussian;
use crate::models::attitude::{BIAS_X, N, PHI, THETA};

/// Standard deviation of the biases, m/s² and rad/s, up to which an instrument counts as calibrated, and from which it
/// does not. A larger one may as well be the pitch of the mount or an error of scale, and |f| = g does not separate
/// them from a bias. Between the two it is doubted in proportion, so that no estimate jumps with what is told.
const CALIBRATED_SD: [Real; 2] = [0.03, 0.06];
/// Standard deviation of the scale of another instrument, and change of the pitch over which it counts as one error,
/// rad.
const SCALE_SD: Real = 0.0075;
const RAMP_RAD: Real = 0.2;
/// Angle by which its axes are askew against each other, rad, and time over which a bend turns to one side, s.
const ASKEW_RAD: Real = 0.025;
const BEND_S: Real = 3.0;

/// Calibration of an IMU.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// 0 for a calibrated instrument, 1 for one that is not.
    doubt: Real,
    accel_bias_sd_mps2: Real,
}

impl Calibration {
    /// Builds the calibration of an instrument with these standard deviations of the biases of accelerometer, m/s², and
    /// gyro, rad/s.
    pub fn new(bias_sd: [Real; 2]) -> Self {
        let [accel_bias_sd_mps2, _] = bias_sd;
        let [calibrated_sd, doubted_sd] = CALIBRATED_SD;
        let largest_sd = bias_sd.iter().fold(0.0, |most: Real, sd| most.max(*sd));
        let doubt = (largest_sd - calibrated_sd) / (doubted_sd - calibrated_sd);
        Self {
            doubt: doubt.clamp(0.0, 1.0),
            accel_bias_sd_mps2,
        }
    }

    /// Returns the doubt in the calibration: 0 for a calibrated instrument, 1 for one that is not.
    pub fn doubted(&self) -> Real {
        self.doubt
    }

    /// Returns the variance of a measurement that rests on the calibration; none where it is not used at all.
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
        let scale = SCALE_SD * GRAVITY;
        belief.P[(BIAS_X, BIAS_X)] += self.doubt * scale * scale * RAMP_RAD * turn_rad.abs();
        let askew = ASKEW_RAD * yaw_rate_radps;
        for angle in [THETA, PHI] {
            belief.P[(angle, angle)] += self.doubt * askew * askew * BEND_S * dt;
        }
    }
}
