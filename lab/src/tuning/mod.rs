//! Search for the parameters of an estimator.
//!
//! A study ([`study`]) names what may vary (`space`), over which runs, and what counts as good (`loss`), measured
//! by the defaults (`baseline`). [`search`] lets an optimiser ([`optimise`]) propose trials, scores each over all
//! tuning runs ([`evaluate`]) and appends it to the store ([`trial_store`]). The winner is then held against the
//! defaults and the published constants on runs it has never seen ([`validate`]), its neighbourhood is mapped
//! (`sensitivity`), and everything is written down (`write`); as a page (`report`) too; [`mod@run`] does all of it.
//! [`objective`] is the score alone, for a search of one's own.

pub(crate) mod baseline;
pub mod evaluate;
pub(crate) mod loss;
pub mod name_check;
pub mod objective;
pub mod optimise;
pub mod progress;
pub(crate) mod report;
pub mod result;
pub mod run;
pub mod search;
pub(crate) mod sensitivity;
pub(crate) mod space;
pub mod study;
pub(crate) mod study_check;
pub mod trial_store;
pub mod validate;
pub(crate) mod write;

pub use study::{TuningFile, TuningStudy};
