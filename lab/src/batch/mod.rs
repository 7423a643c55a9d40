//! Studies: ordered lists of independent runs.
//!
//! A run is addressed by its index in the study ([`RunSpec`]); what comes of it is a
//! [`RunResult`](crate::verdicts::run_result::RunResult), one line of JSON. [`in_order`] makes the runs on several
//! threads and hands the results on in the order of their indices, so that the bytes written do not depend on the
//! number of threads. A [`ResultStore`] keeps them in a file that survives a kill.

mod held_against;
pub(crate) mod jsonl;
pub mod lines;
pub mod made_from;
mod merge;
mod one_run;
mod plan;
mod pool;
mod results;
mod shard;
mod study_file;
pub mod test_shards;
mod vary;

pub use held_against::StudyOfHeader;
pub use merge::merge;
pub(crate) use one_run::run_observed;
pub use one_run::{Interrupted, RunSpec, run_one};
pub use plan::Plan;
pub(crate) use plan::{FORMAT, StudyHeader, VERSION};
pub use pool::{in_order, map_in_order, refused_threads};
pub use results::ResultStore;
pub use shard::Shard;
pub use study_file::StudyFile;
