//! Forces between train and rail and inside the train, one law a file. None of them depends on a physics engine.
//!
//! Square roots of every step are those of `f64`, rounded correctly on every machine. Those of `libm`, which nalgebra's
//! norms take, are SSE instructions in inline assembly: in a build for AVX they made a step of the plant 2.3 times as
//! long.

pub mod adhesion;
pub mod balance;
pub mod body_state;
pub(crate) mod coupling;
pub(crate) mod dynamics;
pub(crate) mod friction;
pub(crate) mod implicit;
pub(crate) mod motor;
mod readings;
pub(crate) mod resistance;
pub(crate) mod running_gear;
