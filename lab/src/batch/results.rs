//! The results of a study as a file: its header, then one line for each run, in the order of their indices.

use crate::batch::jsonl::{Header, Jsonl};
use crate::batch::{Shard, StudyHeader};
use monorig_sim::error::Error;
use serde::Deserialize;
use std::path::Path;

/// The open results of a study.
pub type ResultStore = Jsonl<StudyHeader>;

impl Header for StudyHeader {
    const ROWS: &'static str = "results";
    const ANEW: &'static str = "remove this file to begin anew";

    fn differs(&self, here: &Self) -> Option<String> {
        self.differs(here)
    }
}

impl ResultStore {
    /// Opens the results of a study to go on with them, or begins them.
    pub fn resume(path: &Path, header: &StudyHeader) -> Result<Self, Error> {
        let shard = header.shard.unwrap_or(Shard::WHOLE);
        Self::open(path, header, |n, line| {
            let index = shard.index(n);
            match index_of(line) {
                Some(found) if found == index => Ok(()),
                _ => Err(format!("this is not the result of run {index}")),
            }
        })
    }
}

/// The first field of every line of results.
#[derive(Deserialize)]
struct IndexField {
    index: u64,
}

/// The index of the run of a line; none if the line is not a result.
pub(super) fn index_of(line: &[u8]) -> Option<u64> {
    let start: IndexField = serde_json::from_slice(line).ok()?;
    Some(start.index)
}
