//! What a study has found.

use crate::metrics::series::Sample;
use crate::tuning::search::Found;
use crate::tuning::sensitivity::Sensitivity;
use crate::tuning::trial_store::Trial;
use crate::tuning::validate::Validation;
use std::path::PathBuf;

/// What a study has found.
pub struct Done {
    /// The trials.
    pub found: Found,
    /// The winner on unseen runs; none without a winner.
    pub validation: Option<Validation>,
    /// Its neighbourhood.
    pub sensitivity: Sensitivity,
    /// A validation run of each scenario, with the defaults and with the winner.
    pub traces: Vec<Trace>,
    /// The parameter file.
    pub winner: Option<PathBuf>,
}

impl Done {
    /// The trial that has won, if one has.
    pub fn best(&self) -> Option<&Trial> {
        self.found.trials.get(self.found.winner?)
    }
}

/// A run with the defaults and with the winner.
#[derive(Clone, Debug)]
pub struct Trace {
    /// Scenario.
    pub scenario: String,
    /// With the defaults.
    pub before: Vec<Sample>,
    /// With the winner.
    pub after: Vec<Sample>,
}
