//! The instruments: ideal physics at the mount point, then a composed error model, then faults.
//!
//! | file | what it holds |
//! |---|---|
//! | `accelerometer` `gyro` `inclinometer` `motor_torque` `wheel_speed` `clamp_pressure` `steering_angle` | one instrument a file: ideal physics, channel, construction |
//! | `mounted_instrument` `drive_instruments` | what is alike of instruments bolted to a link, and of those on every drive unit |
//! | `spec` | specification of an instrument, as plain numbers |
//! | `signal_path` | what all have in common: the signal path from ideal value to sample |
//! | `value_sampler` `low_pass` `misalignment` `error_model` `noise` `fault` | the stations of that path |
//! | `shake` `vibration` `hits` `lean` | what the track and a sprung mount do to it |
//! | `sampling` `clock` `delay_line` | when values are taken, what is stamped on them, when they arrive |
//! | `stream` | a seeded random stream for every use |
//! | `mount` | finds the link of the vehicle that a data sheet names |
//! | `suite` | all instruments of a vehicle |
//!
//! A further instrument is a file here with its [`InstrumentKind`], a row of [`KINDS`], a field of
//! [`Measurements`] and a key of [`SheetFile`](crate::config::sensor_sheet_file::SheetFile). One of another crate
//! implements [`Instrument`] and is handed over with
//! [`Suite::fit`]; its readings go into [`Measurements::auxiliary`].

pub mod accelerometer;
pub mod clamp_pressure;
pub mod clock;
pub mod delay_line;
mod drive_instruments;
pub mod error_model;
pub mod fault;
pub mod gyro;
pub mod hits;
pub mod inclinometer;
pub mod lean;
pub mod low_pass;
pub mod misalignment;
pub mod motor_torque;
mod mount;
pub mod mounted_instrument;
pub mod noise;
pub mod sampling;
pub mod shake;
pub mod signal_path;
pub mod spec;
pub mod steering_angle;
pub mod stream;
mod suite;
#[cfg(test)]
mod tests;
pub mod value_sampler;
pub mod vibration;
pub mod wheel_speed;

pub use suite::Suite;

use crate::error::{DataError, Error};
use crate::plant::Truth;
use crate::train::Train;
use fault::FaultWindow;
use monorig_estimators::api::signals::Measurements;
use signal_path::StepInterval;
use spec::InstrumentSpec;

/// Kinds of instruments that a data sheet can name, in the order in which they are read in a step.
pub const KINDS: [InstrumentKind; 7] = [
    accelerometer::KIND,
    gyro::KIND,
    motor_torque::KIND,
    wheel_speed::KIND,
    clamp_pressure::KIND,
    steering_angle::KIND,
    inclinometer::KIND,
];

/// Measures something of the truth: takes samples at its rate and delivers them after its latency.
pub trait Instrument {
    /// Name in data sheets, events and errors, such as `wheel_speed`.
    fn name(&self) -> &str;
    /// Name of a group of instruments that an event can name as one, such as `imu`.
    fn group(&self) -> Option<&str> {
        None
    }
    /// How many readings it has that an event can name one by one, as `name[0]`, `name[1]`, …; 0 if it is one whole.
    fn units(&self) -> usize {
        0
    }
    /// Samples per second, Hz; at most one per physics step.
    fn rate_hz(&self) -> f64;
    /// Index in [`Truth::mounts`] of the mount it sits on. Plants keep the motion of these mounts up to date, and of no others.
    fn mount(&self) -> Option<usize> {
        None
    }
    /// Takes the samples that are due in `step`, at whose end the truth is `truth`; puts what has arrived by then into `z`.
    fn measure(
        &mut self,
        step: StepInterval,
        truth: &Truth,
        z: &mut Measurements,
    ) -> Result<(), Error>;
    /// Puts the ideal values behind the samples last delivered into `z`, with the same stamps.
    fn ideal(&self, _z: &mut Measurements) {}
    /// Adds a fault to reading number `unit`, or to all of them.
    fn add_fault(&mut self, unit: Option<usize>, fault: FaultWindow);
    /// What is recorded of it.
    fn channels(&self) -> Vec<SensorChannel>;
}

/// Takes one reading out of the measurements; `None` without a new sample.
pub type ReadingOf = Box<dyn Fn(&Measurements) -> Option<f64>>;

/// Builds an instrument from its specification.
pub type BuildInstrument =
    fn(&InstrumentSpec, &Fitting<'_>) -> Result<Box<dyn Instrument>, DataError>;

/// A recorded column of an instrument.
pub struct SensorChannel {
    /// Path such as `sensors/drive_1/wheel_speed`.
    pub path: String,
    /// Unit such as `m/s`.
    pub unit: &'static str,
    /// Takes its value out of the measurements; `None` without a new sample.
    pub value: ReadingOf,
}

impl SensorChannel {
    /// A column under `sensors/`.
    pub fn new(
        path: impl std::fmt::Display,
        unit: &'static str,
        value: impl Fn(&Measurements) -> Option<f64> + 'static,
    ) -> Self {
        Self {
            path: format!("sensors/{path}"),
            unit,
            value: Box::new(value),
        }
    }
}

/// A kind of instrument: its name, where it can be fitted, how one is built.
pub struct InstrumentKind {
    /// Name in data sheets, events and errors.
    pub name: &'static str,
    /// Why it cannot be fitted to a car (`true`) or to a train (`false`); `None` if it can.
    pub unsuited: fn(car: bool) -> Option<&'static str>,
    /// Builds one from its specification.
    pub build: BuildInstrument,
}

/// What an instrument is fitted to, the track it rides on, and the seed of its errors.
pub struct Fitting<'a> {
    /// The vehicle.
    pub train: &'a Train,
    /// Gravity, m/s².
    pub gravity_mps2: f64,
    /// Chainages of the rail's joints, ascending, m.
    pub joints_m: &'a [f64],
    /// Seed of the run.
    pub seed: u64,
}

impl<'a> Fitting<'a> {
    /// To this vehicle, on a rail without joints.
    pub fn new(train: &'a Train, gravity_mps2: f64, seed: u64) -> Self {
        Self {
            train,
            gravity_mps2,
            joints_m: &[],
            seed,
        }
    }
}
