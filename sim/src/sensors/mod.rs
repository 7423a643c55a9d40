//! The instruments: ideal physics at the mount point, then a composed error model, then faults.
//!
//! | file | what it holds |
//! |---|---|
//! | `accelerometer` `gyro` `motor_torque` `wheel_speed` `clamp_pressure` `steering_angle` | ideal physics, one instrument a file |
//! | `instrument` | what all have in common: the signal path from ideal value to sample |
//! | `low_pass` `misalignment` `error_model` `noise` `fault` `sampling` | the stations of that path |
//! | `stream` | a seeded random stream for every use |
//! | `mount` | the mount point that the data sheet ([`config::sensor_sheet`](crate::config::sensor_sheet)) names |
//! | `suite` | all instruments of a train |

pub mod accelerometer;
pub mod clamp_pressure;
pub mod error_model;
pub mod fault;
pub mod gyro;
pub mod instrument;
pub mod low_pass;
pub mod misalignment;
pub mod motor_torque;
mod mount;
pub mod noise;
mod per_drive;
pub mod sampling;
pub mod steering_angle;
pub mod stream;
mod suite;
#[cfg(test)]
mod tests;
pub mod wheel_speed;

pub use suite::Suite;

use crate::error::Error;
use crate::plant::Truth;
use monorig_estimators::api::signals::Measurements;

/// All instruments of a train.
pub trait Sensors {
    /// Sample the truth after a step of the plant; put new samples into `z` (cleared by the caller).
    fn measure(&mut self, truth: &Truth, z: &mut Measurements) -> Result<(), Error>;
}
