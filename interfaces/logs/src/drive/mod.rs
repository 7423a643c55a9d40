//! Rows of a log through its map: steps of measurements on the clock of the replay.
//!
//! | file | what it holds |
//! |---|---|
//! | `channel` | one channel: which columns it takes, how they become a value, what waits to be delivered |
//! | `plan` | the channels of a map |
//! | `faults` | faults put on channels |
//! | `steps` | rows into steps: latencies, several samples in a step, gaps, segments |
//! | `stamps` | rate, jitter, gaps and share of the samples of a channel |
//! | `calibrate` | biases and mounting found while the vehicle stands |
//! | `vehicle_file` | the nominal values of a vehicle, as a file of its own |
//! | `reference` `reference_columns` | the references of slope and mass; their columns |
//! | `way` | speed or distance by an instrument that does not roll with the wheels |

mod calibrate;
mod channel;
mod faults;
mod plan;
mod put_faults;
mod reference;
mod reference_columns;
mod stamps;
mod steps;
mod vehicle_file;
mod way;

pub use calibrate::{Found, calibrate};
pub use plan::Plan;
pub(crate) use plan::{axes, mount, tells_mount, turned};
pub use steps::{Drive, Step};
pub use vehicle_file::VehicleFile;

pub(crate) use channel::Target;
pub(crate) use reference::Reference;
pub(crate) use stamps::{ColumnRange, Rate, Stamps};
pub(crate) use way::Way;
