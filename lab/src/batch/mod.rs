//! Runs of scenarios, made on several threads.
//!
//! A run is addressed by its index in a list ([`RunSpec`]); what comes of it is a
//! [`RunResult`](crate::verdicts::run_result::RunResult), one line of JSON. [`in_order`] makes the runs on several
//! threads and hands the results on in the order of their indices, so that the bytes written do not depend on the
//! number of threads. A [`Plan`] is the list of runs of a study.

mod one_run;
mod plan;
mod pool;
mod results;
mod study_file;
mod vary;

pub(crate) use one_run::run_observed;
pub use one_run::{Interrupted, RunSpec, run_one};
pub use plan::Plan;
pub use pool::{in_order, map_in_order, refused_threads};
pub use results::judged;
pub use study_file::StudyFile;
