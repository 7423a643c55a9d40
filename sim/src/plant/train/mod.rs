//! Forces between train and rail and inside the train, one law a file. None of them depends on a physics engine.

pub mod adhesion;
pub mod balance;
pub mod body_state;
pub(crate) mod coupling;
pub(crate) mod dynamics;
pub(crate) mod friction;
pub mod modes;
pub(crate) mod motor;
mod readings;
pub(crate) mod resistance;
pub(crate) mod running_gear;
