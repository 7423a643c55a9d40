//! The map file: the measurements in a log's columns.

mod channel_keys;
mod check;
mod file;
mod formula;
mod load;
mod reference_keys;

pub use file::{MapFile, NoiseSource};
pub use load::Map;

pub(crate) use channel_keys::{
    Axis, Calibrate, CommandChannel, Mount, ScalarChannel, Traction, VectorChannel,
};
pub(crate) use file::{Clock, FaultedChannel, LogFault, LogFaultKind, Many, Origin};
pub(crate) use formula::{Condition, Formula};
pub(crate) use reference_keys::{Altitude, SlopeReference, WayReference};
