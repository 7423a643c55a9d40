//! Conditioning of the channels for robust estimators: outlier hold, gyro calibration, noise learning.

use crate::Real;
use crate::api::params::{choices, params};
use crate::api::snapshot::state;
use crate::api::vehicle::Vehicle;
use crate::preprocess::gyro_calibration::GyroCalibration;
use crate::preprocess::noise_learning::NoiseLearning;
use crate::preprocess::outlier_hold::OutlierHold;

choices! {
    /// Where the noise of wheel speed and accelerometer comes from.
    NoiseSource {
        /// From the parameters.
        Told = "told",
        /// From the samples, where they are noisier than the parameters say.
        Learnt = "learnt",
    }
}

params! {
    /// Conditioning of the channels.
    ConditioningParams {
        outlier_hold [flag] = true, "Hold out jumps of one or two samples of wheel speed, accelerometer and gyro (joints, bumps).";
        gyro_calibration [flag] = true, "Learn the biases of the gyro while the vehicle stands.";
        gyro_bias_sd_radps ["rad/s"] = none, 0.0 => 0.2, "Standard deviation of the gyro's biases at switch-on; not set: that of the vehicle's sheet, or 0.01 (0.6 °/s).";
        noise [choice NoiseSource] = NoiseSource::Learnt, "Noise of wheel speed and accelerometer: told by the parameters, or learnt from the samples where they are noisier than that (up to thirty times).";
    }
}

/// Standard deviation of a gyro's bias of which nothing is said, rad/s.
const GYRO_BIAS_SD_RADPS: Real = 0.01;

/// Steps from sample to sample that are never outliers: wheel speed, m/s, specific force, m/s², angular rate, rad/s.
const FLOORS: [Real; 3] = [0.05, 1.0, 0.2];

/// Largest acceleration of wheels that roll, m/s², on a rail and on a road.
const MAX_ACCELERATION_MPS2: [Real; 2] = [3.0, 12.0];

/// A channel that has paused for so long may have any value, s.
const PAUSE_S: Real = 0.3;

/// Largest learnt over told standard deviation.
const MAX_NOISE_RATIO: Real = 30.0;

/// Noise learnt from the samples; `None` where it is told, or not yet known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LearntNoise {
    /// Standard deviation of wheel speed, m/s.
    pub wheel_speed_mps: Option<Real>,
    /// Standard deviation of the specific force along the train, m/s².
    pub specific_force_mps2: Option<Real>,
}

impl LearntNoise {
    /// Standard deviation of wheel speed to use where `told` is that of the parameters, m/s.
    pub fn wheel_speed(&self, told: Real) -> Real {
        bounded(self.wheel_speed_mps, told)
    }

    /// Standard deviation of the specific force to use where `told` is that of the parameters, m/s².
    pub fn specific_force(&self, told: Real) -> Real {
        bounded(self.specific_force_mps2, told)
    }
}

/// Not below what is told: what the samples do not show (a median of wheels, a mean of samples) is no licence for more trust.
fn bounded(learnt: Option<Real>, told: Real) -> Real {
    learnt.map_or(told, |sd| sd.clamp(told, MAX_NOISE_RATIO * told))
}

/// Conditioning of the channels of one estimator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditioning {
    params: ConditioningParams,
    max_mps2: Real,
    speed: OutlierHold,
    /// Specific force forward and left, rate of pitch and yaw.
    inertial: [OutlierHold; 4],
    gyro: GyroCalibration<2>,
    noise: [NoiseLearning; 2],
}

/// An axis of the IMU that is conditioned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Specific force forward.
    Forward,
    /// Specific force to the left.
    Left,
    /// Pitch rate.
    Pitch,
    /// Yaw rate.
    Yaw,
}

impl Conditioning {
    /// For a vehicle.
    pub fn new(vehicle: &Vehicle, params: ConditioningParams) -> Self {
        let [speed, force, rate] = FLOORS.map(OutlierHold::new);
        let [rail, road] = MAX_ACCELERATION_MPS2;
        let bias_sd = params.gyro_bias_sd_radps.or(vehicle.gyro_bias_sd_radps);
        Self {
            params,
            max_mps2: if vehicle.road.is_some() { road } else { rail },
            speed,
            inertial: [force, force, rate, rate],
            gyro: GyroCalibration::new(bias_sd.unwrap_or(GYRO_BIAS_SD_RADPS)),
            noise: [NoiseLearning::of_speed(), NoiseLearning::of_acceleration()],
        }
    }

    /// A new speed by the wheels, m/s, `period_s` after the one before; `None` if it is held out.
    pub fn speed(&mut self, speed_mps: Real, period_s: Real, standing: bool) -> Option<Real> {
        if period_s > PAUSE_S {
            self.speed.restart();
        }
        let passed = if self.params.outlier_hold {
            self.speed.take(speed_mps, self.max_mps2 * period_s)?
        } else {
            speed_mps
        };
        let [noise, _] = &mut self.noise;
        if !standing && period_s < PAUSE_S {
            noise.observe(passed, period_s);
        }
        Some(passed)
    }

    /// The last speed that was not held out, m/s.
    pub fn last_speed(&self) -> Option<Real> {
        self.speed.value()
    }

    /// A new sample of an axis of the IMU, `period_s` after the one before; the sample to go on with.
    pub fn axis(&mut self, axis: Axis, value: Real, period_s: Real, standing: bool) -> Real {
        let mut passed = value;
        if self.params.outlier_hold
            && let Some(hold) = self.inertial.get_mut(axis as usize)
        {
            if period_s > PAUSE_S {
                hold.restart();
            }
            passed = match hold.take(value, 0.0) {
                Some(value) => value,
                None => return hold.value().unwrap_or(value),
            };
        }
        let [_, noise] = &mut self.noise;
        if axis == Axis::Forward && !standing && period_s < PAUSE_S {
            noise.observe(passed, period_s);
        }
        passed
    }

    /// Learns the gyro's biases: one step of `dt` seconds, with new rates of pitch and yaw `period_s` after those before.
    pub fn calibrate(&mut self, standing: bool, rates: Option<[Real; 2]>, period_s: Real, dt: Real) {
        if self.params.gyro_calibration {
            self.gyro.step(standing, rates, period_s, dt);
        }
    }

    /// Biases of pitch and yaw rate, rad/s.
    pub fn gyro_bias_radps(&self) -> [Real; 2] {
        self.gyro.bias_radps()
    }

    /// Their standard deviation, rad/s.
    pub fn gyro_bias_sd_radps(&self) -> Real {
        self.gyro.sd_radps()
    }

    /// The noise learnt so far.
    pub fn learnt_noise(&self) -> LearntNoise {
        if self.params.noise == NoiseSource::Told {
            return LearntNoise::default();
        }
        let [speed, force] = &self.noise;
        LearntNoise {
            wheel_speed_mps: speed.sd(),
            specific_force_mps2: force.sd(),
        }
    }
}

state!(Conditioning { speed, inertial, gyro, noise; params, max_mps2 });

#[cfg(test)]
#[path = "conditioning_tests.rs"]
mod tests;
