//! monorig-sim: truth → sensors → estimators → controller.

pub mod bank;
mod believed;
pub mod checked;
pub mod control;
pub mod error;
pub mod file;
mod nearness;
pub mod plant;
pub mod point_mass;
pub mod rail;
pub mod record;
pub mod rig;
pub mod road;
pub mod run;
pub mod scenario;
pub mod sensors;
pub mod surroundings;
pub mod timeline;
pub mod train;
pub mod world;
