//! The rail as the train has read it, and the train on it.

pub mod mass_on_rail;
pub mod rail_memory;
pub mod train_means;
