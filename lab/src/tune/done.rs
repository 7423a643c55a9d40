//! What a study has found.

use super::search::Found;
use super::sensitivity::Sensitivity;
use super::store::Trial;
use super::validate::Validation;
use crate::series::Sample;
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
