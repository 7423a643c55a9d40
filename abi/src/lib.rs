//! The structs of `include/monorig_estimator.h` in Rust, and what they are here. Plain data both ways, without a heap:
//! the host of libraries (`plugin`) and ours as a library (`c`) share it.
//!
//! | file | what it holds |
//! |---|---|
//! | `text` | texts in structs |
//! | `input` | measurements and command of a step |
//! | `estimate` | estimate, aid status |
//! | `vehicle` | the nominal vehicle |
//! | `parameter` | a parameter there is, and one that is set |
#![no_std]

#[cfg(test)]
extern crate std;

mod estimate;
mod input;
mod parameter;
mod text;
mod vehicle;

pub use estimate::{Aid, Estimated, ValueOut};
pub use input::{Input, Triple, Value};
pub use parameter::{Parameter, SetParameter};
pub use text::{Label, Reason, Text};
pub use vehicle::{Mass, NominalVehicle};

/// Number of the header.
pub const ABI: u32 = 1;
/// Alignment of the memory of an instance, bytes.
pub const ALIGNMENT: usize = 16;
/// All went well.
pub const OK: i32 = 0;
/// No such item, or the step is refused.
pub const REFUSED: i32 = 1;
/// The instance cannot go on.
pub const BROKEN: i32 = 2;
