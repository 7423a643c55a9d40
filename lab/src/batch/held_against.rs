//! Lines of results held against the study that their header names: seed, scenario and drawn values of every run follow
//! from the study, so that a line that was edited, or is of another study, is found.

use crate::batch::{Shard, StudyFile, StudyHeader};
use crate::verdicts::run_result::RunResult;
use monorig_sim::record::manifest;
use std::path::Path;

/// The study of a header.
pub struct StudyOfHeader {
    file: StudyFile,
    shard: Shard,
}

/// More shards than this are taken for a mistake.
const MAX_SHARDS: u64 = 1_000_000;

impl StudyOfHeader {
    /// Reads the first line of a file of results.
    pub fn parse(line: &str) -> Result<Self, String> {
        let header = serde_json::from_str(line);
        Self::new(&header.map_err(|e| format!("this is not the header of a study: {e}"))?)
    }

    /// Reads the study in a header. The error says what of the header does not fit the rest of it.
    pub(crate) fn new(header: &StudyHeader) -> Result<Self, String> {
        let from = &header.made_from;
        if manifest::hash(&from.monorig, &from.inputs, &from.resolved) != from.hash {
            return Err(
                "its header was edited: its hash is not that of program, inputs and study in it"
                    .into(),
            );
        }
        let study = from.resolved.get("study").cloned().unwrap_or_default();
        let file: StudyFile = serde_json::from_value(study)
            .map_err(|e| format!("its header has no study of ours: {e}"))?;
        let shard = header.shard.unwrap_or(Shard::WHOLE);
        let whole = (1..=shard.of.min(MAX_SHARDS)).contains(&shard.part) && shard.of <= MAX_SHARDS;
        if file.runs != header.runs || !whole || file.first_seed.checked_add(file.runs).is_none() {
            return Err("its header was edited: runs and shard do not fit its study".into());
        }
        for vary in &file.vary {
            vary.check().map_err(|(message, _)| message)?;
        }
        Ok(Self { file, shard })
    }

    /// Checks the result in line `n` (from 0) behind the header.
    pub fn check(&self, n: u64, result: &RunResult) -> Result<(), String> {
        let index = self.shard.index(n);
        if result.index != index || index >= self.file.runs {
            return Err(format!("this is not the result of run {index}"));
        }
        let seed = self.file.first_seed + index;
        let stem = Path::new(&self.file.scenario)
            .file_stem()
            .unwrap_or_default();
        if result.seed != seed || result.scenario != stem.to_string_lossy() {
            return Err(format!(
                "this is {} seed {}, and run {index} of the study is {} seed {seed}",
                result.scenario,
                result.seed,
                stem.to_string_lossy()
            ));
        }
        let drawn = self.file.vary.iter();
        let mut drawn = drawn.map(|vary| (vary.path.clone(), vary.draw(seed)));
        let all = result.draws.len() == self.file.vary.len();
        if !all || drawn.any(|(path, value)| result.draws.get(&path) != Some(&value)) {
            return Err(format!(
                "the drawn values are not those of run {index} of the study"
            ));
        }
        result.check()
    }
}
