//! Rows of a log through its map: steps of measurements on the clock of the replay.
//!
//! | file | what it holds |
//! |---|---|
//! | `channel` | one channel: which columns it takes, how they become a value, what waits to be delivered |
//! | `plan` | the channels of a map |
//! | `faults` | faults put on channels |
//! | `steps` | rows into steps: latencies, several samples in a step, gaps, segments |
//! | `calibrate` | biases and mounting found while the vehicle stands |
//! | `vehicle_file` | what estimators are told about a vehicle, as a file of its own |
//! | `reference` `reference_columns` | slope and mass that estimates are held against; their columns |
//! | `way` | speed or distance by an instrument that does not roll with the wheels |

mod calibrate;
mod channel;
mod faults;
mod plan;
mod reference;
mod reference_columns;
mod steps;
pub mod vehicle_file;
mod way;

pub use calibrate::{Found, calibrate};
pub use channel::Target;
pub use plan::Plan;
pub use reference::{Reference, ReferenceSlope};
pub use steps::{Drive, Step};
pub use way::Way;
