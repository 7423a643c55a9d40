//! The file that the runs of a battery are added to, so that one that was stopped goes on.

use crate::batch::Shard;
use crate::batch::jsonl::{Header, Jsonl};
use crate::batch::made_from::MadeFrom;
use serde::{Deserialize, Serialize};

/// The first line of the file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StressHeader {
    /// Kind of the file: `monorig stress`.
    pub(crate) format: String,
    /// Number of runs of the whole battery.
    pub(crate) runs: u64,
    /// The part of them that is here.
    pub(crate) shard: Shard,
    /// Origin of the battery.
    pub made_from: MadeFrom,
}

impl StressHeader {
    /// Digits by which folders of results differ.
    pub fn short_hash(&self) -> &str {
        self.made_from.hash.get(..12).unwrap_or_default()
    }
}

impl Header for StressHeader {
    const ROWS: &'static str = "results";
    const ANEW: &'static str = "remove this file to begin anew";

    fn differs(&self, here: &Self) -> Option<String> {
        let parts = (self.shard != here.shard || self.runs != here.runs)
            .then(|| "another part of another number of runs".to_owned());
        parts.or(self.made_from.differs(&here.made_from))
    }
}

/// The open file.
pub type StressStore = Jsonl<StressHeader>;
