//! Models of vehicle and rail that the estimators share.

pub mod distributed_train;
pub mod force_balance;
pub mod grade_map;
pub mod map_gaps;
pub mod rail_memory;
pub mod regressors;
pub mod single_track;
pub mod swing;
pub mod train_means;
