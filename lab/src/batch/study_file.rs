//! Study files: a scenario, how often it is run, and what varies from run to run.

use crate::batch::vary::Vary;
use monorig_sim::config::checked::Version1;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A study file.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StudyFile {
    /// Format version, 1.
    pub(crate) version: Version1,
    /// Why the study exists and what it shows.
    pub(crate) why: String,
    /// Scenario file, relative to this file.
    pub(crate) scenario: String,
    /// How many runs.
    pub(crate) runs: u64,
    /// Seed of the first run; each further run has the next one.
    #[serde(default = "one")]
    pub(crate) first_seed: u64,
    /// Fixed changes to the scenario, by path as in `--set`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) set: BTreeMap<String, serde_json::Value>,
    /// What is drawn for each run.
    #[serde(default)]
    pub(crate) vary: Vec<Vary>,
}

fn one() -> u64 {
    1
}
