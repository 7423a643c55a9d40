//! Progress of a tuning run: an observer shows it and may stop the run.

use crate::tuning::trial_store::Trial;

/// Observer that follows a tuning run and may stop it. Called from several threads.
pub trait Progress: Sync {
    /// Reports the share of a stage that is done, 0…1. Returns whether to go on.
    fn stage(&self, name: &str, share: f64) -> bool;
    /// Reports a scored trial; `best` is the best trial so far. Returns whether to go on.
    fn trial(&self, trial: &Trial, best: Option<&Trial>, budget: usize) -> bool;
}

/// Without progress: the run goes on to its end.
impl Progress for () {
    fn stage(&self, _: &str, _: f64) -> bool {
        true
    }

    fn trial(&self, _: &Trial, _: Option<&Trial>, _: usize) -> bool {
        true
    }
}
