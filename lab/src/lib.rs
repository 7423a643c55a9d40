//! monorig-lab: the work on finished runs.
//!
//! The core measures and judges. Each room uses only rooms above it.
//!
//! | room | contents |
//! |---|---|
//! | [`text`] | numbers and names as people read them |
//! | [`bound`] | the error that no estimator can fall below |
//! | [`metrics`] | errors of every estimator, sample by sample, and the numbers that sum them up |
//! | [`verdicts`] | a run in numbers, its expectations, estimators side by side |
//! | [`campaign`] | lists of runs and their files: results that survive a kill, shards put together |
//! | [`batch`] | many runs on several threads; studies |
//! | [`draw`] | courses drawn at random, as scenario files |
//! | [`stress`] | a battery of conditions for estimators, one at a time |
//!
//! The extras stand on the core.
//!
//! | room | contents |
//! |---|---|
//! | [`mapping`] | the profile of a rail from the estimates of several passages |
//! | [`replay`] | measurements of a run recorded once and played to any number of estimators |
//! | [`explain`] | the share of each source of error in the errors of the estimators |
//! | [`reports`] | pages of figures and tables |
//! | [`recordings`] | noise, bias and vibration of recorded instruments |
//! | [`tuning`] | parameters found by search |

pub mod batch;
pub mod bound;
pub mod campaign;
pub mod draw;
pub mod explain;
pub mod mapping;
pub mod metrics;
pub mod recordings;
pub mod replay;
pub mod reports;
pub mod stress;
pub mod text;
pub mod tuning;
pub mod verdicts;

/// Compiles the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
