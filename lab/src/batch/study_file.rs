//! Study files: a scenario, how often it is run, and what varies from run to run.

use crate::batch::vary::Vary;
use monorig_sim::config::checked::Version1;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;

/// A study file.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StudyFile {
    /// Format version, 1.
    pub(crate) version: Version1,
    /// Purpose of the study and what it shows.
    pub(crate) why: String,
    /// Scenario file, relative to this file.
    pub(crate) scenario: String,
    /// Number of runs; with a `grid` the number of runs at each point.
    pub(crate) runs: u64,
    /// Seed of the first run; each further run has the next seed.
    #[serde(default = "one")]
    pub(crate) first_seed: u64,
    /// Fixed changes to the scenario, by path as in `--set`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) set: BTreeMap<String, Value>,
    /// Values that are drawn for each run.
    #[serde(default)]
    pub(crate) vary: Vec<Vary>,
    /// Values by path; every combination of values is a point, which is run with the same seeds.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) grid: BTreeMap<String, Vec<Value>>,
}

impl StudyFile {
    /// Number of points of the grid; `None` if the number is too large, or a path has no value.
    pub(crate) fn points(&self) -> Option<u64> {
        let lengths = self.grid.values().map(|values| values.len() as u64);
        let points = lengths.into_iter().try_fold(1_u64, u64::checked_mul);
        points.filter(|n| *n > 0)
    }

    /// The values of the run at this place with this seed, by path: those of its point of the grid, and those drawn.
    pub(crate) fn values(&self, place: u64, seed: u64) -> BTreeMap<String, Value> {
        let mut point = place / self.runs.max(1);
        let mut values = BTreeMap::new();
        for (path, all) in self.grid.iter().rev() {
            let n = all.len().max(1) as u64;
            let value = all.get((point % n) as usize).cloned();
            values.insert(path.clone(), value.unwrap_or_default());
            point /= n;
        }
        values.extend(
            self.vary
                .iter()
                .map(|vary| (vary.path.clone(), vary.draw(seed))),
        );
        values
    }
}

fn one() -> u64 {
    1
}
