//! What a tuning study has come to.

use crate::metrics::series::ErrorSample;
use crate::tuning::search::SearchResult;
use crate::tuning::sensitivity::Sensitivity;
use crate::tuning::trial_store::Trial;
use crate::tuning::validate::Validation;
use std::path::PathBuf;

/// What a tuning study has come to.
pub struct TuningResult {
    /// The search and its trials.
    pub search: SearchResult,
    /// The winner on unseen runs; none without a winner.
    pub validation: Option<Validation>,
    /// Its neighbourhood.
    pub sensitivity: Sensitivity,
    /// A validation run of each scenario, with the defaults and with the winner.
    pub traces: Vec<Trace>,
    /// The parameter file.
    pub winner: Option<PathBuf>,
}

impl TuningResult {
    /// The trial that has won, if one has.
    pub fn best(&self) -> Option<&Trial> {
        self.search.trials.get(self.search.winner?)
    }
}

/// A run with the defaults and with the winner.
#[derive(Clone, Debug)]
pub struct Trace {
    /// Scenario.
    pub scenario: String,
    /// With the defaults.
    pub before: Vec<ErrorSample>,
    /// With the winner.
    pub after: Vec<ErrorSample>,
}
