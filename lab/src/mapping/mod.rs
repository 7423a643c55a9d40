//! Rail maps from runs: the surveyed profile of the rail that a run has gone over, with standard deviations.
//!
//! An estimator has a better grade of a place some time after the passage than at the place: under the
//! middle of the unit that carries the IMU the pitch is that of the rail, while what is ahead of it must be guessed
//! (a fixed lag of the length of the arm), and the bias of the accelerometer is known best at the end. A map keeps
//! sin θ + b/g by place, which the accelerometer reads directly, and takes the bias of the end off.

mod passage;
mod profile;

pub use passage::Passage;
pub use profile::{MapPoint, profile, to_csv, to_track};
