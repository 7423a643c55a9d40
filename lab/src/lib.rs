//! monorig-lab: what is done with runs.
//!
//! | room | what is in it |
//! |---|---|
//! | [`metrics`] | errors of every estimator, sample by sample, and the numbers that sum them up |
//! | [`verdicts`] | a run in numbers, whether it does what it is expected to, estimators side by side |
//! | [`hidden`] | characters that a terminal or a reader must not be given as they are |
//! | [`made_from`] | what results were made from and by |
//! | [`batch`] | many runs on several threads: studies, shards, results that survive a kill |
//! | [`bound`] | what no estimator can be better than |
//! | [`explain`] | how much of the errors each source of error makes |
//! | [`draw`] | courses drawn at random, as scenario files |
//! | [`replay`] | measurements of a run recorded once and played to any number of estimators |
//! | [`tuning`] | parameters found by search |
//! | [`recordings`] | noise, bias and vibration of recorded instruments |
//! | [`plot`] | figures, a file for each kind |
//! | [`report`] | pages of figures and tables |

pub mod batch;
pub mod bound;
pub mod draw;
pub mod explain;
pub mod hidden;
pub mod html;
pub mod made_from;
pub mod mapping;
pub mod metrics;
pub mod plot;
pub mod recordings;
pub mod replay;
pub mod report;
pub mod tuning;
pub mod verdicts;

/// The example of the README compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
