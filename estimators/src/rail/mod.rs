//! The rail as the train has read it, and the train on it.

pub mod distributed_train;
pub mod grade_map;
pub mod map_gaps;
pub mod rail_memory;
pub mod train_means;
