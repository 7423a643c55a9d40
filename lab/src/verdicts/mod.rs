//! Numbers of runs, and verdicts on them.
//!
//! A run's [`summary`] holds its metrics and a verdict for each thing the scenario expects ([`expected`] checks that
//! these can be measured at all) and the `integrity` of its estimators; [`findings`] are what misleads, worst first;
//! [`overview`] is the table of a run; [`verdict`] judges all seeds of a scenario together, and [`judgement`] says what
//! this comes to; [`compare`] holds estimators against each other over the same runs, with the confidence
//! [`interval`]s of their differences.
//! [`signals`] holds two runs against each other sample by sample. [`run_files`] leaves the folder of a run.

pub mod common;
pub mod compare;
pub mod expected;
pub mod findings;
pub(crate) mod integrity;
pub mod interval;
pub mod judgement;
pub mod measure;
pub mod overview;
pub mod run_files;
pub mod run_result;
pub mod signals;
pub mod summary;
pub mod verdict;
pub(crate) mod weakened;
