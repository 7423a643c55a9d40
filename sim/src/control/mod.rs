//! Control: drive cycle, perception and controller. Uses estimates and measurements, never the truth (except where a
//! scenario has `feedforward: truth`, an upper limit).
//!
//! | file | what it holds |
//! |---|---|
//! | `controller` | the interface of a controller |
//! | `drive_cycle` | the speed reference by time or by chainage |
//! | `perception` | speed, slip, mass and grade as the controller sees them |
//! | `speed_controller` | our controller: PI with feed-forward |

mod controller;
mod drive_cycle;
mod perception;
mod speed_controller;

pub use controller::{Controller, ControllerSetup};
pub(crate) use drive_cycle::Cycle;
pub use drive_cycle::Reference;
pub(crate) use perception::PerceptionModel;
pub use perception::{FeedForward, Perception};
pub(crate) use speed_controller::{SpeedController, SpeedControllerParams};
