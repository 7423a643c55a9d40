//! The results of a study as a file: its header, then one line for each run, in the order of their indices.

use crate::batch::jsonl::{Header, Jsonl};
use crate::batch::lines::wrong;
use crate::batch::{StudyHeader, StudyOfHeader};
use crate::verdicts::run_result::RunResult;
use monorig_sim::error::Error;
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
        let study = StudyOfHeader::new(header)
            .map_err(|message| wrong(path, None, message, "a study that monorig has read"))?;
        Self::open(path, header, |n, line| {
            let result: RunResult = serde_json::from_slice(line)
                .map_err(|_| format!("row {n} is not the result of a run"))?;
            study.check(n, &result)
        })
    }
}
