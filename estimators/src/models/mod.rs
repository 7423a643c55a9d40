//! Models of vehicle and rail that the estimators share.

pub mod attitude;
pub mod force_balance;
pub mod sample;
pub mod single_track;
pub mod slope_force;
pub mod swing;
pub mod swing_balance;
