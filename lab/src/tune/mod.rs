//! Parameters of an estimator found by search instead of guessed.
//!
//! A study ([`study`]) says what may vary ([`space`]), over which runs, and what counts as good ([`loss`]), measured by the defaults
//! ([`yardstick`]). [`search`] lets an optimiser ([`optimise`]) propose trials, scores each over all tuning runs ([`evaluate`]) and appends it to the store
//! ([`store`]). The winner is then held against the defaults and the published constants on runs it has never seen
//! ([`validate`]), its neighbourhood is mapped ([`sensitivity`]), and everything is written down ([`mod@write`]); as a page ([`report`]) too; [`job`] does all of it.

pub mod check;
pub mod done;
pub mod evaluate;
pub mod job;
pub mod known;
pub mod loss;
pub mod optimise;
pub mod report;
pub mod search;
pub mod sensitivity;
pub mod side_by_side;
pub mod space;
pub mod store;
pub mod study;
pub mod validate;
pub mod write;
pub mod yardstick;

pub use study::{Study, StudyFile};
