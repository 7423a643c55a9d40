//! The map file: what a log's columns measure.

mod channel_keys;
mod channels;
mod check;
mod faulted_channel;
mod file;
mod formula;
mod load;
mod reference_keys;

pub use channel_keys::{
    Axis, Calibrate, CommandChannel, Mount, ScalarChannel, Traction, VectorChannel, WheelChannel,
};
pub use channels::{Channels, MeasuredChannel};
pub(crate) use channels::{key, quantity};
pub use faulted_channel::FaultedChannel;
pub use file::{
    Clock, LogFault, LogFaultKind, Many, MapFile, NoiseSource, Nominal, Order, Origin, Provenance,
    StepSettings, TimeSettings,
};
pub use formula::{Condition, Formula};
pub use load::Map;
pub use reference_keys::{
    Altitude, MassReference, MassStep, References, SlopeReference, WayReference,
};
