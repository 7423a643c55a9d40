//! The map file: what a log's columns measure.

mod channel_keys;
mod check;
mod file;
mod formula;
mod load;
mod reference_keys;

pub use channel_keys::{
    Axis, Calibrate, Channels, CommandChannel, Mount, ScalarChannel, Traction, VectorChannel,
    WheelChannel,
};
pub use file::{
    Clock, FaultedChannel, LogFault, LogFaultKind, Many, MapFile, NoiseSource, Nominal, Order,
    Origin, Provenance, StepSettings, TimeSettings,
};
pub use formula::{Condition, Formula};
pub use load::Map;
pub use reference_keys::{
    Altitude, MassReference, MassStep, References, SlopeReference, WayReference,
};
