//! Control: drive cycle, perception and speed controller. Sees estimates and measurements, never the truth (except where a scenario asks for
//! `feedforward: truth`, an upper limit).

mod drive_cycle;
mod perception;
mod speed_controller;

pub use drive_cycle::{Cycle, Reference};
pub use perception::Perception;
pub use speed_controller::SpeedController;
