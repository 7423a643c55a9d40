//! The file of a matrix: its runs and its cells as JSON; shards put together.

use crate::batch::Shard;
use crate::stress::{Battery, ConditionRow, Matrix, MatrixCell, StressHeader, StressRun};
use monorig_sim::config::file::{input_error, read_result};
use monorig_sim::error::Error;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Kind of the file.
const KIND: &str = "stress";

/// A matrix with what it was made from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StressFile {
    version: u32,
    kind: String,
    /// The program.
    pub monorig: String,
    /// SHA-256 over program, files, conditions and scenarios.
    made_from: String,
    /// The part of the runs that is here; all if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    shard: Option<Shard>,
    /// Number of runs of the whole battery.
    all_runs: u64,
    /// Scenarios with their seeds.
    pub scenarios: BTreeMap<String, Vec<u64>>,
    /// Estimators.
    pub estimators: Vec<String>,
    /// Rows.
    pub rows: Vec<ConditionRow>,
    /// Cells, worst first.
    pub cells: Vec<MatrixCell>,
    /// Runs, in the order of their indices.
    pub runs: Vec<StressRun>,
}

impl StressFile {
    /// Makes it of the runs of a battery that are there.
    pub fn new(battery: &Battery, header: &StressHeader, runs: Vec<StressRun>) -> Self {
        let whole = header.shard == Shard::WHOLE;
        Self {
            version: 1,
            kind: KIND.into(),
            monorig: header.made_from.monorig.to_string(),
            made_from: header.made_from.hash.clone(),
            shard: (!whole).then_some(header.shard),
            all_runs: header.runs,
            scenarios: battery.scenarios(),
            estimators: battery.estimators().to_vec(),
            rows: battery.rows(),
            cells: Vec::new(),
            runs,
        }
        .with_cells()
    }

    fn with_cells(mut self) -> Self {
        self.cells = Matrix::of(&self.rows, &self.estimators, &self.runs).cells;
        self
    }

    /// Reads a file that was written before.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = read_result(path)?;
        let file = serde_json::from_str::<Self>(&text);
        file.ok()
            .filter(|file| file.kind == KIND)
            .ok_or_else(|| wrong(path, "this is no matrix of a stress battery".into()))
    }

    /// As it stands in the file.
    pub fn to_json(&self) -> String {
        // Strings and finite numbers: nothing in here can fail to serialise.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// True if a file of this name is such a file.
    pub fn is_one(path: &Path) -> bool {
        Self::read(path).is_ok()
    }

    /// The row of a condition.
    pub fn row(&self, condition: &str) -> Option<&ConditionRow> {
        self.rows.iter().find(|r| r.condition == condition)
    }
}

/// Puts the shards of a battery together: what the whole would have been.
pub fn merge_stress(parts: &[PathBuf], to: &Path) -> Result<StressFile, Error> {
    let mut whole: Option<StressFile> = None;
    let mut seen = Vec::new();
    for path in parts {
        let mut part = StressFile::read(path)?;
        let Some(shard) = part.shard.take() else {
            return Err(wrong(path, "this is a whole matrix, and no shard".into()));
        };
        if seen.contains(&shard.part) {
            return Err(wrong(path, format!("shard {} is there twice", shard.part)));
        }
        seen.push(shard.part);
        match &mut whole {
            None => whole = Some(part),
            Some(whole) if whole.made_from == part.made_from => whole.runs.extend(part.runs),
            Some(_) => {
                let message = "this is a shard of another battery than the first file";
                return Err(wrong(path, message.into()));
            }
        }
    }
    let Some(mut whole) = whole else {
        return Err(wrong(to, "there is nothing to merge".into()));
    };
    whole.runs.sort_by_key(|run| run.index);
    if !whole.runs.iter().map(|run| run.index).eq(0..whole.all_runs) {
        let message = format!("{} of {} runs are here", whole.runs.len(), whole.all_runs);
        return Err(wrong(to, message));
    }
    Ok(whole.with_cells())
}

fn wrong(path: &Path, message: String) -> Error {
    let help =
        "files that `monorig stress --json FILE` has written; of shards each once, 1/n to n/n";
    input_error(path, "", message, help)
}
