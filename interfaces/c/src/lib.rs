//! The header `include/monorig_estimator.h` in Rust: its structs as plain data without a heap, which the host of
//! libraries (`interfaces/foreign`) uses too, and its functions with our estimators behind them, a shared and a static
//! library for a program in C or a microcontroller.
//!
//! | file | what it holds |
//! |---|---|
//! | `text` | texts in structs |
//! | `input` | measurements and command of a step |
//! | `estimate` | estimate, aid status |
//! | `vehicle` | the nominal vehicle |
//! | `parameter` | a parameter there is, and one that is set |
//! | `functions` | the functions (feature `functions`) |
#![no_std]

// its panic handler
#[cfg(not(target_os = "none"))]
extern crate std;

mod estimate;
#[cfg(feature = "functions")]
mod functions;
mod input;
mod parameter;
mod text;
mod vehicle;

pub use estimate::{Aid, Estimated, ValueOut};
pub use input::{Input, StampedValue, Triple, Value};
pub use parameter::{Parameter, SetParameter};
pub use text::{Label, Reason, Text};
pub use vehicle::{Mass, NominalVehicle};

/// Number of the header.
pub const ABI: u32 = 1;
/// Alignment of the memory of an instance, bytes.
pub const ALIGNMENT: usize = 16;
/// Success.
pub const OK: i32 = 0;
/// No such item, or the step is refused.
pub const REFUSED: i32 = 1;
/// The instance cannot go on.
pub const BROKEN: i32 = 2;
