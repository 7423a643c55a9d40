//! The map file: what a log's columns measure.

mod check;
mod file;
mod formula;
mod load;

pub use file::{
    Altitude, Axis, Calibrate, Channels, Clock, CommandChannel, FaultedChannel, LogFault,
    LogFaultKind, Many, MapFile, MassReference, MassStep, Mount, Nominal, Order, Origin,
    Provenance, References, ScalarChannel, SlopeReference, StepSettings, TimeSettings, Traction,
    VectorChannel, WheelChannel,
};
pub use formula::Formula;
pub use load::Map;
