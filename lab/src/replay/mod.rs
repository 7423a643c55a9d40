//! Simulate once, estimate often: what a run's estimators were given, kept to be given to others.
//!
//! An estimator that is not in the loop does not change the motion, so the measurements of a scenario and seed are
//! the same for every parameter set of it. They are recorded ([`record`]), kept on disk under a content hash
//! ([`cache`]) and played to an estimator ([`play`]) hundreds of times faster than the run itself.

pub mod cache;
pub(crate) mod data;
pub mod play;
pub mod record;

pub use data::ReplayData;
