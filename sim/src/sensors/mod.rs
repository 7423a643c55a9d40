//! The instruments: ideal physics at the mount point, then a composed error model, then faults.
//!
//! | file | what it holds |
//! |---|---|
//! | `instruments/` | one instrument a file, and their list, which is the data sheet too |
//! | `instrument` | the trait [`Instrument`], its recorded columns, [`InstrumentKind`] |
//! | `spec/` | specification of an instrument, as a data sheet holds it |
//! | `fitting` | what an instrument is fitted to |
//! | `signal_path` | what all have in common: the signal path from ideal value to sample |
//! | `value_sampler` `low_pass` `misalignment` `error_model` `noise` `fault` | the stations of that path |
//! | `shake` `vibration` `hits` `lean` | what the track and a sprung mount do to it |
//! | `step_interval` `sampling` `clock` `delay_line` | the instants of values, their stamps, their arrival |
//! | `stream` | a seeded random stream for every use |
//! | `suite` | all instruments of a vehicle |
//!
//! How to add one of ours: see [`instruments`]. One of another crate implements [`Instrument`] and is handed over with
//! [`Suite::fit`]; its readings go into `Measurements::auxiliary`.

#[cfg(test)]
mod behaviour;
mod clock;
mod delay_line;
mod error_model;
pub mod fault;
mod fitting;
mod hits;
mod instrument;
pub mod instruments;
mod lean;
mod low_pass;
mod misalignment;
pub mod noise;
mod sampling;
mod shake;
mod signal_path;
pub mod spec;
mod step_interval;
pub mod stream;
mod suite;
mod value_sampler;
mod vibration;

pub use fitting::Fitting;
pub use instrument::{BuildInstrument, Instrument, InstrumentKind, ReadingOf, SensorChannel};
pub use step_interval::StepInterval;
pub use suite::Suite;
