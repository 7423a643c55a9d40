//! Models of vehicle and rail that the estimators share.

pub mod force_balance;
pub mod regressors;
pub mod single_track;
pub mod swing;
