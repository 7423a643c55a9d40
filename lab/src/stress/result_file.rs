//! The file of a matrix: its runs and its cells as JSON.

use crate::campaign::{Campaign, CampaignRow};
use crate::stress::{ConditionRow, DrawnSummary, Matrix, MatrixCell, NOMINAL, StressRun};
use monorig_sim::config::file::{input_error, read_result};
use monorig_sim::error::Error;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Kind of the file.
const KIND: &str = "stress";

/// A matrix with its program and inputs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StressFile {
    version: u32,
    kind: String,
    /// The program.
    pub monorig: String,
    /// SHA-256 over program, files, conditions and scenarios.
    made_from: String,
    /// Scenarios with their seeds.
    pub scenarios: BTreeMap<String, Vec<u64>>,
    /// Estimators.
    pub estimators: Vec<String>,
    /// Rows.
    pub rows: Vec<ConditionRow>,
    /// Cells, worst first.
    pub cells: Vec<MatrixCell>,
    /// Summary over all rows, if they were drawn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub summary: Option<DrawnSummary>,
    /// Runs, in the order of their indices.
    pub runs: Vec<StressRun>,
}

impl StressFile {
    /// Makes the matrix of all runs of a battery.
    pub fn new(campaign: &Campaign, runs: Vec<StressRun>) -> Self {
        let BatteryPlan { estimators, rows } = BatteryPlan::of(campaign).unwrap_or_default();
        let cells = Matrix::of(&rows, &estimators, &runs).cells;
        let lists = campaign.list.iter();
        let scenarios = lists.map(|list| (list.scenario.clone(), list.seeds().collect()));
        Self {
            version: 1,
            kind: KIND.into(),
            monorig: campaign.monorig.to_string(),
            made_from: campaign.hash.clone(),
            scenarios: scenarios.collect(),
            summary: DrawnSummary::of(&rows, &estimators, &cells, &runs),
            cells,
            estimators,
            rows,
            runs,
        }
    }

    /// Reads an earlier file.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let file = serde_json::from_str::<Self>(&read_result(path)?);
        file.ok().filter(|file| file.kind == KIND).ok_or_else(|| {
            let message = "this is not the matrix of a stress battery";
            let help = "use a file that `monorig stress --json FILE` wrote, not a shard";
            input_error(path, "", message, help)
        })
    }

    /// Content of the file.
    pub fn to_json(&self) -> String {
        // Strings and finite numbers: nothing in here can fail to serialise.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// Conditions that changed no input of an estimator.
    pub fn idle(&self) -> Vec<&str> {
        let of = |row: &&ConditionRow| {
            let cells = || self.cells.iter().filter(|c| c.condition == row.condition);
            row.condition != NOMINAL
                && cells().any(|c| c.runs > 0)
                && cells().all(|c| c.changed + c.broken == 0)
        };
        let nominal = self.row(NOMINAL).is_some();
        let idle = self.rows.iter().filter(|_| nominal).filter(of);
        idle.map(|row| row.condition.as_str()).collect()
    }

    /// The row of a condition.
    pub fn row(&self, condition: &str) -> Option<&ConditionRow> {
        self.rows.iter().find(|r| r.condition == condition)
    }
}

/// Values of a battery in the header of its results.
#[derive(Default, Deserialize)]
struct BatteryPlan {
    /// Names of the estimators.
    estimators: Vec<String>,
    /// Rows of the matrix.
    rows: Vec<ConditionRow>,
}

impl BatteryPlan {
    /// Reads them.
    fn of(campaign: &Campaign) -> Result<Self, String> {
        let plan = serde_json::from_value(campaign.resolved.clone());
        plan.map_err(|e| format!("its header has no battery of monorig: {e}"))
    }
}

impl CampaignRow for StressRun {
    type Plan = ();

    fn plan(campaign: &Campaign) -> Result<(), String> {
        BatteryPlan::of(campaign).map(drop)
    }

    fn check(&self, campaign: &Campaign, (): &(), index: u64) -> Result<(), String> {
        let run = campaign.is_run(index, &self.scenario, self.seed)?;
        match self.index == index && run.list.condition.as_ref() == Some(&self.condition) {
            true => Ok(()),
            false => Err(format!(
                "this is not the result of run {index}, but that of run {} under {}",
                self.index, self.condition
            )),
        }
    }
}
