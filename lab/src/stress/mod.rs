//! Stress: a battery of conditions, applied one at a time over a few scenarios and seeds, and what becomes of the
//! estimators under each.
//!
//! A [`Condition`] is a file of changes to a scenario. A [`Battery`] is the list of runs: without a condition
//! ([`NOMINAL`]) and under each; or pairs of a drawn course and a drawn [`fault`]. A [`StressRun`] is what one of them
//! has come to, a line of JSON; a [`Matrix`] has a cell for each condition and estimator, over all scenarios and seeds;
//! a [`DrawnSummary`] is over drawn conditions.

mod against;
mod base;
mod battery;
mod condition;
mod drawn;
mod matrix;
mod print;
mod result_file;
mod stress_run;
mod summary;

pub use against::{Difference, SHARE_TOLERANCE, differences};
pub use base::WantedEstimator;
pub use battery::{Battery, Pairing};
pub use condition::{Classes, Condition, ConditionFile, Group};
pub use drawn::{fault, fault_name};
pub use matrix::{ConditionRow, Figures, Matrix, MatrixCell};
pub use result_file::StressFile;
pub use stress_run::StressRun;
pub use summary::{ClassRow, DrawnSummary, EstimatorSummary, MISLED};

/// Name of the row without a condition.
pub const NOMINAL: &str = "nominal";
