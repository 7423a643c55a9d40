//! monorig-sim: truth → sensors → estimators → controller, a closed loop around a simulated vehicle.
//!
//! | module | what it holds |
//! |---|---|
//! | [`config`] | the files of a scenario: YAML, URDF, CSV and STL, read and checked |
//! | [`rail`] | geometry of the rail |
//! | [`train`] | data model of the train: bodies, connections, drives |
//! | [`plant`] | what moves: rigid bodies in rapier, a car on a road, a point mass; out comes the truth |
//! | [`sensors`] | instruments: truth in, samples with errors and faults out |
//! | [`control`] | drive cycle, perception, speed controller |
//! | [`closed_loop`] | the loop itself, and how it is built from a scenario |
//! | [`record`] | channels of a run, written to and read from files |

pub mod closed_loop;
pub mod config;
pub mod control;
pub mod error;
pub mod plant;
pub mod rail;
pub mod record;
pub mod sensors;
#[cfg(any(test, feature = "testing"))]
pub mod testing;
pub mod train;
