//! `trials.jsonl`: a header, then a line for each trial, in order.

use crate::batch::jsonl::{Header, Jsonl};
use crate::batch::lines::wrong;
use crate::batch::made_from::MadeFrom;
use crate::tuning::study::Values;
use monorig_sim::config::file::read_result;
use monorig_sim::error::Error;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Description of the study that the trials belong to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrialsHeader {
    /// Name of the study.
    pub study: String,
    /// Origin of the study.
    pub made_from: MadeFrom,
}

/// A trial and its score.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// From 0.
    pub trial: usize,
    /// Who proposed it: `default`, `published` or `search`.
    pub origin: String,
    /// Its parameters.
    pub parameters: Values,
    /// Its loss (one per metric for a front), the defaults' being 1; empty if it failed.
    pub losses: Vec<f64>,
    /// Violation of the constraints, in shares of their bounds; 0 = all held.
    pub violation: f64,
    /// Why it failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failed: Option<String>,
}

impl Trial {
    /// The sum of its losses: what winners have least of. Infinite if it failed or breaks a constraint.
    pub fn loss(&self) -> f64 {
        if self.losses.is_empty() || self.violation > 0.0 {
            f64::INFINITY
        } else {
            self.losses.iter().sum::<f64>() / self.losses.len() as f64
        }
    }
}

/// The open trials of a study.
pub type TrialStore = Jsonl<TrialsHeader>;

impl Header for TrialsHeader {
    const ROWS: &'static str = "trials";
    const ANEW: &'static str = "start anew with --restart";

    fn differs(&self, here: &Self) -> Option<String> {
        let study = format!("{} there, {} here", self.study, here.study);
        let study = (self.study != here.study).then_some(study);
        study.or_else(|| self.made_from.differs(&here.made_from))
    }
}

impl TrialStore {
    /// Begins a file. Trials that are there stay, and are an error.
    pub fn create(path: &Path, header: &TrialsHeader) -> Result<Self, Error> {
        vacant(path)?;
        Self::replace(path, header)
    }

    /// Opens a file of the same study, or begins it. Returns the trials in it.
    pub fn resume(path: &Path, header: &TrialsHeader) -> Result<(Self, Vec<Trial>), Error> {
        let mut trials: Vec<Trial> = Vec::new();
        let store = Self::open(path, header, |n, line| {
            let trial = serde_json::from_slice::<Trial>(line);
            let trial = trial.map_err(|e| format!("this is no line of monorig's: {e}"))?;
            if trial.trial as u64 != n {
                return Err(format!("this is not trial {n}"));
            }
            trials.push(trial);
            Ok(())
        })?;
        Ok((store, trials))
    }
}

/// Refuses a file that has trials.
pub(super) fn vacant(path: &Path) -> Result<(), Error> {
    let trials = count(path);
    if trials == 0 {
        return Ok(());
    }
    Err(wrong(
        path,
        Some(1),
        format!("there are {trials} trials already, and they are not dropped unasked"),
        "go on with --resume; begin anew with --restart, or in another folder with --out",
    ))
}

/// Number of whole trials in a file; 0 if there is no file.
pub(super) fn count(path: &Path) -> usize {
    let text = read_result(path).unwrap_or_default();
    let lines = text.bytes().filter(|b| *b == b'\n').count();
    lines.saturating_sub(1) // the header
}
