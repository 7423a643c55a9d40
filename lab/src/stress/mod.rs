//! Stress: a battery of conditions, applied one at a time over a few scenarios and seeds, and what becomes of the
//! estimators under each.
//!
//! A [`Condition`] is a file of changes to a scenario. A [`Battery`] is the list of runs: without a condition
//! ([`NOMINAL`]) and under each. A [`StressRun`] is what one of them has come to, a line of JSON; a [`Matrix`] has a
//! cell for each condition and estimator, over all scenarios and seeds.

mod against;
mod battery;
mod condition;
mod matrix;
mod print;
mod result_file;
mod stress_run;

pub use against::{Difference, SHARE_TOLERANCE, differences};
pub use battery::{Battery, WantedEstimator};
pub use condition::{Condition, ConditionFile, Group};
pub use matrix::{ConditionRow, Figures, Matrix, MatrixCell};
pub use result_file::StressFile;
pub use stress_run::StressRun;

/// Name of the row without a condition.
pub const NOMINAL: &str = "nominal";
