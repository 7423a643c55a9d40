//! `trials.jsonl`: a header, then a line for each trial, in order.

use crate::campaign::{Campaign, CampaignRow, wrong};
use crate::tuning::study::Values;
use monorig_sim::config::file::read_result;
use monorig_sim::error::Error;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A trial and its score.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// From 0.
    pub trial: usize,
    /// Who proposed it: `default`, `published` or `search`.
    pub origin: String,
    /// Parameters of the trial.
    pub parameters: Values,
    /// Loss (one per metric for a front); the loss of the defaults is 1; empty if the trial failed.
    pub losses: Vec<f64>,
    /// Violation of the constraints, as a share of their bounds; 0 = all held.
    pub violation: f64,
    /// Reason why the trial failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failed: Option<String>,
}

impl Trial {
    /// Sum of the trial's losses: what winners have least of. Infinite if it failed or breaks a constraint.
    pub fn loss(&self) -> f64 {
        if self.losses.is_empty() || self.violation > 0.0 {
            f64::INFINITY
        } else {
            self.losses.iter().sum::<f64>() / self.losses.len() as f64
        }
    }
}

impl CampaignRow for Trial {
    type Plan = ();

    fn plan(_: &Campaign) -> Result<(), String> {
        Ok(())
    }

    fn check(&self, _: &Campaign, (): &(), index: u64) -> Result<(), String> {
        match self.trial as u64 == index {
            true => Ok(()),
            false => Err(format!("this is not trial {index}")),
        }
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
        format!("{trials} trials exist already, and monorig does not drop them by itself"),
        "continue with --resume, start again with --restart, or use another folder with --out",
    ))
}

/// Number of complete trials in a file; 0 if the file does not exist.
pub(super) fn count(path: &Path) -> usize {
    let text = read_result(path).unwrap_or_default();
    let lines = text.bytes().filter(|b| *b == b'\n').count();
    lines.saturating_sub(1) // the header
}
