//! Verdicts: of scenarios that were tested, of shards put together, of studies; for people and for machines.

pub(crate) mod junit;
pub(crate) mod lines;
pub(crate) mod stress;
pub(crate) mod study;

use monorig_lab::verdicts::verdict::ScenarioVerdict;
use std::path::Path;
use std::time::Duration;

/// A scenario that was tested.
pub(crate) struct TestedScenario {
    /// Its verdicts.
    pub(crate) judged: ScenarioVerdict,
    /// Why it could not be used, if it could not.
    pub(crate) unusable: Option<String>,
    /// Time its runs took together.
    pub(crate) took: Duration,
}

impl TestedScenario {
    /// Makes a scenario whose runs took so long together.
    pub(crate) fn new(judged: ScenarioVerdict, took: Duration) -> Self {
        let unusable = None;
        Self {
            judged,
            unusable,
            took,
        }
    }

    /// Makes a scenario that cannot be used: it fails, and has no run.
    pub(crate) fn unusable(path: &Path, why: String) -> Self {
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        let mut judged = ScenarioVerdict::new(&name, Vec::new());
        for check in &mut judged.checks {
            check.what = "the scenario".into();
            check.bound = "can be used".into();
            check.worst = Some(why.clone());
        }
        Self {
            judged,
            unusable: Some(why),
            took: Duration::ZERO,
        }
    }
}
