//! Models of vehicle and rail that the estimators share.

pub(crate) mod attitude;
pub mod force_balance;
pub(crate) mod sample;
pub(crate) mod single_track;
pub(crate) mod slope_force;
pub(crate) mod swing;
pub(crate) mod swing_balance;
