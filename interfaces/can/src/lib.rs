//! Samples, commands and estimates as CAN frames: what `monorig log export --to can` writes, and what an estimator on a
//! controller is given and answers. Plain data both ways without a heap, so that firmware is built from the same
//! source.
//!
//! | file | what it holds |
//! |---|---|
//! | `frame` | a frame, and its bits |
//! | `message` | the messages: identifier, name, signals |
//! | `signal` | a signal: bits, factor, unit, as fixed-point or floating-point number |
//! | `step` | samples and command of a step as frames, and back |
//! | `answer` | an estimate as frames, and back |
//! | `ecu` | an estimator behind frames |
//! | `dbc` | the DBC of the messages |
//! | `candump` | a frame as a line of candump |
//! | `cannelloni` | frames in a datagram of cannelloni |
#![no_std]

#[cfg(test)]
extern crate std;

pub mod answer;
pub mod candump;
pub mod cannelloni;
pub mod dbc;
pub mod ecu;
pub mod frame;
pub mod message;
pub mod signal;
pub mod step;

/// Numbers of steps there are: a step's number is its remainder.
pub const SEQUENCES: u16 = 1 << 15;
