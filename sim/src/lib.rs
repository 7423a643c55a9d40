//! monorig-sim: truth → sensors → estimators → controller.

pub mod checked;
pub mod error;
pub mod file;
pub mod plant;
pub mod rail;
pub mod record;
pub mod scenario;
pub mod sensors;
pub mod train;
