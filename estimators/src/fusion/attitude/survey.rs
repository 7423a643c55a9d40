//! What the attitude filter tells of the rail behind the IMU: the grade with a fixed lag, and the readings that a map is made of.
//!
//! The grade at the IMU must be guessed over the arm between the unit's middle and the IMU. Once the middle has come to the place the pitch is
//! the grade there: a lag of one arm in way, whatever the speed, and no guess. A unit on wheels has the pitch of the chord between them.

use super::{AttitudeFilter, BIAS_X, GYRO_Z, MODEL_SD_RAD, SCALE};
use crate::Real;
use crate::api::real::sqrt;

/// A grade that is told late.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LaggedGrade {
    /// Grade of the rail under the middle of the unit that carries the IMU, rad.
    pub grade_rad: Real,
    /// Its standard deviation, rad.
    pub sd_rad: Real,
    /// How far behind the IMU that is, m.
    pub lag_m: Real,
}

/// Error of the chord as a share of that of the grade carried ahead over the arm: for d²θ/ds² it is w²/6 against l²/2, a third where half the wheelbase
/// w is the arm l.
const CHORD_SHARE: Real = 1.0 / 3.0;

impl AttitudeFilter {
    /// The grade where the IMU was one arm ago.
    pub fn lagged_grade(&self) -> LaggedGrade {
        let pitch = self.found.pitch_sd_rad;
        let (mount, chord) = (self.mount_sd_rad(), CHORD_SHARE * self.arm.sd_rad(0.0));
        LaggedGrade {
            grade_rad: self.found.pitch_rad,
            sd_rad: sqrt(
                pitch * pitch + mount * mount + chord * chord + MODEL_SD_RAD * MODEL_SD_RAD,
            ),
            lag_m: self.lever.ahead_m,
        }
    }

    /// What a map of the rail is made with: standard deviations of the accelerometer's bias (m/s²), of sin θ + b/g with that of the mounting, of
    /// the scale of the wheels; how far the IMU is ahead of the place whose pitch is told (m).
    pub fn reading(&self) -> [Real; 4] {
        let P = &self.belief.P;
        let (read, mount) = (self.found.sum_sd, self.mount_sd_rad());
        [
            sqrt(P[(BIAS_X, BIAS_X)]),
            sqrt(read * read + mount * mount + MODEL_SD_RAD * MODEL_SD_RAD),
            sqrt(P[(SCALE, SCALE)]),
            self.lever.ahead_m,
        ]
    }

    /// Heading since the start, rad, + left, within ±π, and its standard deviation.
    pub fn heading(&self) -> [Real; 2] {
        [self.heading.angle_rad(), self.heading.sd_rad()]
    }

    /// Standard deviation of the gyro's bias of the yaw rate, rad/s.
    pub(super) fn yaw_bias_sd_radps(&self) -> Real {
        sqrt(self.belief.P[(GYRO_Z, GYRO_Z)])
    }
}
