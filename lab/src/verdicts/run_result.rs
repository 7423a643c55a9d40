//! The result of one run, as a line of JSON.

use crate::verdicts::summary::Summary;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Result of one run: one line of JSON in the results of a study.
#[serde_with::skip_serializing_none]
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RunResult {
    /// Place in the study, from 0.
    pub index: u64,
    /// Scenario name.
    pub scenario: String,
    /// Seed.
    pub seed: u64,
    /// Values drawn for this run, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub draws: BTreeMap<String, serde_json::Value>,
    /// Metrics and verdicts; none if the run broke down.
    pub summary: Option<Summary>,
    /// Reason why the run broke down, if it did.
    pub error: Option<String>,
}

impl RunResult {
    /// Makes the result of a run without draws: its numbers, or why it broke down.
    pub fn new(scenario: &str, seed: u64, outcome: Result<Summary, String>) -> Self {
        let (summary, error) = match outcome {
            Ok(summary) => (Some(summary), None),
            Err(error) => (None, Some(error)),
        };
        Self {
            index: 0,
            scenario: scenario.to_owned(),
            seed,
            draws: BTreeMap::new(),
            summary,
            error,
        }
    }

    /// Checks that the statements of the result follow from its numbers. The error says what does not.
    pub fn check(&self) -> Result<(), String> {
        let Some(summary) = &self.summary else {
            return match self.error {
                Some(_) => Ok(()),
                None => Err("this run has neither numbers nor an error".into()),
            };
        };
        if (&summary.scenario, summary.seed) != (&self.scenario, self.seed) {
            return Err(format!(
                "this run is of {} seed {}, but its numbers are of {} seed {}",
                self.scenario, self.seed, summary.scenario, summary.seed
            ));
        }
        summary.check()
    }

    /// Summary of a finished run.
    pub(crate) fn whole(&self) -> Option<&Summary> {
        self.summary.as_ref().filter(|s| s.finished)
    }

    /// True if the run finished.
    pub fn finished(&self) -> bool {
        self.whole().is_some()
    }
}
