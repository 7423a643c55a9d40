//! The result of a tuning study.

use crate::metrics::series::ErrorSample;
use crate::tuning::search::SearchResult;
use crate::tuning::sensitivity::Sensitivity;
use crate::tuning::trial_store::Trial;
use crate::tuning::validate::Validation;

/// The result of a tuning study.
pub struct TuningResult {
    /// The search and its trials.
    pub search: SearchResult,
    /// The winner on unseen runs; `None` without a winner.
    pub validation: Option<Validation>,
    /// Neighbourhood of the winner.
    pub(crate) sensitivity: Sensitivity,
    /// A validation run of each scenario, with the defaults and with the winner.
    pub(crate) traces: Vec<Trace>,
}

impl TuningResult {
    /// Winning trial, if there is one.
    pub fn best(&self) -> Option<&Trial> {
        self.search.trials.get(self.search.winner?)
    }
}

/// A run with the defaults and with the winner.
#[derive(Clone, Debug)]
pub(crate) struct Trace {
    pub(crate) scenario: String,
    /// With the defaults.
    pub(crate) before: Vec<ErrorSample>,
    /// With the winner.
    pub(crate) after: Vec<ErrorSample>,
}
