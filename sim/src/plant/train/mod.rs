//! Forces between train and rail and inside the train, one law a file. None of them knows a physics engine.

pub mod adhesion;
pub mod balance;
pub mod body_state;
pub mod coupling;
pub mod dynamics;
pub mod friction;
pub mod modes;
pub mod motor;
pub mod resistance;
pub mod running_gear;
