//! Outputs of the attitude filter about the rail: the grade at the IMU, the grade with a fixed lag, the readings that a
//! map is made of, and the heading.
//!
//! The grade at the IMU must be guessed over the arm between the unit's middle and the IMU. Once the middle has come to
//! the place the pitch is the grade there: a lag of one arm in way, whatever the speed, and no guess. A unit on wheels
//! has the pitch of the chord between them.

use super::AttitudeFilter;
use super::separation::Separation;
use crate::Real;
use crate::api::real::{PI, sqrt};
use crate::api::snapshot::state;
use crate::models::attitude::{BIAS_X, GYRO_Z, SCALE};
use crate::models::force_balance::MAX_GRADE_RAD;
use crate::tuning::SURVEY;

/// A grade with a lag of one arm of the IMU in distance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LaggedGrade {
    /// Grade of the rail under the middle of the unit that carries the IMU, rad.
    pub grade_rad: Real,
    /// Its standard deviation, rad.
    pub sd_rad: Real,
}

state!(LaggedGrade { grade_rad, sd_rad; });

impl AttitudeFilter {
    /// Grade at the IMU, rad: that under the unit's middle and the curvature over the arm.
    pub fn grade_at_imu_rad(&self) -> Real {
        let grade = self.found.pitch_rad + self.model.lever.ahead_m * self.found.curvature_per_m;
        grade.clamp(-MAX_GRADE_RAD, MAX_GRADE_RAD)
    }

    /// Standard deviation of the grade at the IMU, rad.
    pub fn grade_at_imu_sd_rad(&self) -> Real {
        let arm = self.arm.sd_rad(self.found.curvature_per_m);
        let pitch = self.found.pitch_sd_rad;
        let (mount, moved) = (self.mount_sd_rad(), self.found.moved_on_rad);
        let known =
            pitch * pitch + arm * arm + mount * mount + SURVEY.model_sd_rad * SURVEY.model_sd_rad;
        sqrt(known + moved * moved)
    }

    /// Standard deviation of errors of the pitch that the filter cannot observe, rad, common to all grades: that of the
    /// IMU's mounting, and what instruments that contradict each other leave open.
    pub fn mount_sd_rad(&self) -> Real {
        self.params.mount_sd_deg * PI / 180.0 + self.separation_sd_rad()
    }

    /// The separation of the pitches, if it counts.
    fn separated(&self) -> Option<&Separation> {
        Some(&self.separation).filter(|_| self.supervision.separation)
    }

    /// Largest separation of the pitches beyond what is usual, rad; 0 without separation.
    pub fn apart_rad(&self) -> Real {
        self.separated().map_or(0.0, Separation::apart_rad)
    }

    /// Standard deviation of the pitch due to instruments that contradict each other, rad; 0 while they agree.
    pub fn separation_sd_rad(&self) -> Real {
        self.separated().map_or(0.0, Separation::open_rad)
    }

    /// The grade at the place where the IMU was one arm length ago.
    pub fn lagged_grade(&self) -> LaggedGrade {
        let pitch = self.found.pitch_sd_rad;
        let (mount, chord) = (
            self.mount_sd_rad(),
            SURVEY.chord_share * self.arm.sd_rad(0.0),
        );
        LaggedGrade {
            grade_rad: self.found.pitch_rad,
            sd_rad: sqrt(
                pitch * pitch
                    + mount * mount
                    + chord * chord
                    + SURVEY.model_sd_rad * SURVEY.model_sd_rad,
            ),
        }
    }

    /// Readings that a map of the rail needs: standard deviations of the accelerometer's bias, m/s², of sin θ + b/g
    /// without that of the mounting, which all places share, and of the scale of the wheels; distance of the IMU ahead
    /// of the place whose pitch is estimated, m.
    pub fn reading(&self) -> [Real; 4] {
        let P = &self.belief.P;
        let read = self.found.sum_sd;
        [
            sqrt(P[(BIAS_X, BIAS_X)]),
            sqrt(read * read + SURVEY.model_sd_rad * SURVEY.model_sd_rad),
            sqrt(P[(SCALE, SCALE)]),
            self.model.lever.ahead_m,
        ]
    }

    /// Heading since the start, rad, + left, within ±π, and its standard deviation.
    pub fn heading(&self) -> [Real; 2] {
        [self.heading.angle_rad(), self.heading.sd_rad()]
    }

    /// Standard deviation of the gyro's bias of the yaw rate, rad/s.
    #[allow(
        clippy::indexing_slicing,
        reason = "indices of states are constants below N"
    )]
    pub(super) fn yaw_bias_sd_radps(&self) -> Real {
        sqrt(self.belief.P[(GYRO_Z, GYRO_Z)])
    }
}
