//! The signals of a step as estimators read them: checked, merged, `None` where not known.

use crate::Real;
use crate::api::aid::Rejection;
use crate::api::signals::MAX_DRIVES;

/// Ratio of the learnt standard deviation to the parameter above which the learnt one is used, and largest ratio.
const NOISE_RATIOS: [Real; 2] = [2.0, 30.0];

/// The signals of one step; `None` = not known now (stale, stuck, or never sampled).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// Speed by the wheels, m/s, if at least one drive unit sent a new sample.
    pub new_speed_mps: Option<Real>,
    /// Speed by the fresh wheels, m/s ([`crate::preprocess::wheel_speed_vote::WheelSpeedVote`]).
    pub speed_mps: Option<Real>,
    /// Reason why there is no speed, or no new speed, although wheels are sampled: most of them slip, all are stuck, or
    /// the sample was held out as an outlier (the speed is then the last one).
    pub wheel_speed_fault: Option<Rejection>,
    /// Sum of all motor torques, N·m.
    pub motor_torque_nm: Option<Real>,
    /// Torque of drive 0, N·m: on a road vehicle that of the front, steered axle.
    pub front_torque_nm: Option<Real>,
    /// Specific force along the train, m/s².
    pub specific_force_mps2: Option<Real>,
    /// Specific force to the left, m/s².
    pub lateral_force_mps2: Option<Real>,
    /// Specific force upwards, m/s²: g at rest on the level.
    pub vertical_force_mps2: Option<Real>,
    /// Rate of the pitch angle, rad/s, + when the grade grows.
    pub pitch_rate_radps: Option<Real>,
    /// Rate about the vertical axis, rad/s, + to the left.
    pub yaw_rate_radps: Option<Real>,
    /// Noise learnt from the samples.
    pub noise: LearntNoise,
    /// Steering angle of a road vehicle's front wheels, rad, + to the left.
    pub steering_angle_rad: Option<Real>,
    /// Share of the clamp brake commanded, 0…1.
    pub brake: Real,
    /// All axes of the IMU, and each drive unit separately.
    pub channels: Channels,
}

/// Channels behind the merged signals of a [`Reading`], for estimators that gate each channel themselves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Channels {
    /// Specific force in IMU axes, m/s².
    pub specific_force_mps2: Option<[Real; 3]>,
    /// Angular rate in IMU axes, rad/s.
    pub angular_rate_radps: Option<[Real; 3]>,
    /// True for the specific force, and for the angular rate, that is a new sample.
    pub new: [bool; 2],
    /// Wheel speed of each drive unit with a new sample, m/s.
    pub new_wheel_speed_mps: [Option<Real>; MAX_DRIVES],
    /// True if wheel speeds are out of use because they are stuck.
    pub wheels_stuck: bool,
    /// Motor torque of each drive unit, N·m.
    pub motor_torque_nm: [Option<Real>; MAX_DRIVES],
    /// Motor torque commanded of each drive unit, N·m.
    pub commanded_torque_nm: [Real; MAX_DRIVES],
    /// Age of the newest torque, specific force and wheel speed when they came, by their stamps, s.
    pub age_s: [Real; 3],
    /// Time since the last step by the clock, s.
    pub since_s: Real,
}

/// Noise learnt from the samples; `None` if the parameters give the noise, or if it is not known yet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LearntNoise {
    /// Standard deviation of wheel speed, m/s.
    pub wheel_speed_mps: Option<Real>,
    /// Standard deviation of the specific force along the train, m/s².
    pub specific_force_mps2: Option<Real>,
}

impl LearntNoise {
    /// Standard deviation of wheel speed to use, given the parameter `told`, m/s.
    pub fn wheel_speed(&self, told: Real) -> Real {
        bounded(self.wheel_speed_mps, told)
    }

    /// Standard deviation of the specific force to use, given the parameter `told`, m/s².
    pub fn specific_force(&self, told: Real) -> Real {
        bounded(self.specific_force_mps2, told)
    }
}

/// Bounds the learnt standard deviation by the parameter `told`. It is never below `told`: samples do not show all of
/// the noise (a median of wheels, a mean of samples). It counts only from twice `told` on, because it contains the
/// vehicle's own motion, and up to thirty times `told`.
fn bounded(learnt: Option<Real>, told: Real) -> Real {
    let [least, most] = NOISE_RATIOS;
    let counts = learnt.filter(|sd| *sd > least * told);
    counts.map_or(told, |sd| sd.min(most * told))
}
