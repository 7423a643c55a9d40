//! Two recorded runs.

use crate::reports::run::recorded::Recorded;
use crate::verdicts::run_files::CHANNELS;
use monorig_sim::error::Error;
use std::path::{Path, PathBuf};

/// Two runs; B is compared with A.
pub struct Pair {
    pub(super) a: Recorded,
    pub(super) b: Recorded,
}

impl Pair {
    /// Read the folders of both.
    pub fn read(a: &Path, b: &Path) -> Result<Self, Error> {
        Ok(Self {
            a: Recorded::read(a)?,
            b: Recorded::read(b)?,
        })
    }

    /// The files with the channels of A and B.
    pub(super) fn channels(&self) -> [PathBuf; 2] {
        [&self.a, &self.b].map(|run| run.folder.join(CHANNELS))
    }

    /// Estimators of both runs.
    pub(super) fn estimators(&self) -> impl Iterator<Item = &str> {
        let names = self.a.summary.estimators.keys();
        let common = names.filter(|n| self.b.summary.estimators.contains_key(*n));
        common.map(String::as_str)
    }
}
