//! The map file: the measurements in a log's columns.

mod channel_keys;
mod channels;
mod check;
pub(crate) mod edit;
mod faulted_channel;
mod file;
mod formula;
mod load;
mod reference_keys;

pub use file::{MapFile, NoiseSource, faults_of_logs};
pub use load::Map;

pub(crate) use channel_keys::{
    Axis, Calibrate, CommandChannel, Mount, ScalarChannel, Traction, VectorChannel,
};
pub(crate) use channels::{MeasuredChannel, key, quantity};
pub(crate) use faulted_channel::FaultedChannel;
pub(crate) use file::{Clock, LogFault, LogFaultKind, Many, Nominal, Origin};
pub(crate) use formula::{Condition, Formula};
pub(crate) use reference_keys::{SlopeReference, WayReference};
