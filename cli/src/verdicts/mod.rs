//! Verdicts of tested scenarios, of joined shards and of studies; for people and for machines.

mod drawn;
pub(crate) mod junit;
pub(crate) mod lines;
pub(crate) mod stress;
pub(crate) mod study;

use crate::identity::identity;
use monorig_lab::verdicts::judgement::Totals;
use monorig_lab::verdicts::verdict::ScenarioVerdict;
use serde_json::json;
use std::path::Path;
use std::time::Duration;

/// Verdicts and metrics of a test, for programs.
pub(crate) fn json<'a>(
    verdicts: impl Iterator<Item = &'a ScenarioVerdict> + Clone,
) -> serde_json::Value {
    json!({
        "version": 1,
        "kind": "test",
        "monorig": identity().to_string(),
        "verdict": Totals::of(verdicts.clone()).words(),
        "scenarios": verdicts.collect::<Vec<_>>(),
    })
}

/// A scenario that was tested.
pub(crate) struct TestedScenario {
    /// Its verdicts.
    pub(crate) judged: ScenarioVerdict,
    /// Reason why the scenario cannot be used, if it cannot.
    pub(crate) unusable: Option<String>,
    /// Total time of the runs.
    pub(crate) took: Duration,
}

impl TestedScenario {
    /// Makes a tested scenario; `took` is the total time of its runs.
    pub(crate) fn new(judged: ScenarioVerdict, took: Duration) -> Self {
        let unusable = None;
        Self {
            judged,
            unusable,
            took,
        }
    }

    /// Makes a scenario that cannot be used: it fails, without a run.
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
