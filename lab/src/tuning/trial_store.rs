//! `trials.jsonl`: a line that says what study this is, then a line for each trial, in order, written as they come. A line torn
//! by a kill is cut off, and the search goes on behind it.

use crate::batch::made_from::MadeFrom;
use crate::tuning::study::Values;
use monorig_sim::config::file::read_result;
use monorig_sim::error::{Error, InputError};
use monorig_sim::record::whole;
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

/// What study the trials are of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrialsHeader {
    /// Name of the study.
    pub study: String,
    /// What it is made from and by.
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
    /// By how much it breaks constraints, in shares of their bounds; 0 = all held.
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

/// The open file.
pub struct TrialStore {
    path: PathBuf,
    file: File,
}

impl TrialStore {
    /// A new file with its header. Trials that are there stay, and are an error.
    pub fn create(path: &Path, header: &TrialsHeader) -> Result<Self, Error> {
        vacant(path)?;
        Self::replace(path, header)
    }

    /// A new file with its header, in place of an older one.
    pub fn replace(path: &Path, header: &TrialsHeader) -> Result<Self, Error> {
        whole::replaceable(path)?;
        let file = File::create(path).map_err(|e| at(path, e))?;
        let mut store = Self {
            path: path.into(),
            file,
        };
        store.line(header)?;
        Ok(store)
    }

    /// An existing file of the same study, and the trials in it.
    pub fn resume(path: &Path, header: &TrialsHeader) -> Result<(Self, Vec<Trial>), Error> {
        let bytes = read_result(path)?.into_bytes();
        let whole = bytes.iter().rposition(|b| *b == b'\n').map_or(0, |i| i + 1);
        let text = String::from_utf8_lossy(&bytes[..whole]);
        let mut lines = (1..).zip(text.lines());
        let Some((_, first)) = lines.next() else {
            return Ok((Self::replace(path, header)?, Vec::new()));
        };
        let found: TrialsHeader = read(path, 1, first)?;
        if found != *header {
            return Err(wrong(
                path,
                1,
                match found.made_from.differs(&header.made_from) {
                    Some(what) => format!("these trials were made from something else: {what}"),
                    None => format!("these are trials of {}", found.study),
                },
                "start anew with --restart, or name another folder with --out",
            ));
        }
        let mut trials: Vec<Trial> = Vec::new();
        for (n, line) in lines {
            let trial: Trial = read(path, n, line)?;
            if trial.trial != trials.len() {
                return Err(wrong(
                    path,
                    n,
                    format!("trial {} follows {} others", trial.trial, trials.len()),
                    "start anew with --restart",
                ));
            }
            trials.push(trial);
        }
        let file = OpenOptions::new()
            .append(true)
            .open(path)
            .map_err(|e| at(path, e))?;
        file.set_len(whole as u64).map_err(|e| at(path, e))?;
        let store = Self {
            path: path.into(),
            file,
        };
        Ok((store, trials))
    }

    /// Add a trial.
    pub fn add(&mut self, trial: &Trial) -> Result<(), Error> {
        self.line(trial)
    }

    fn line(&mut self, what: &impl Serialize) -> Result<(), Error> {
        // Strings and finite numbers: nothing in here can fail to serialise.
        let line = serde_json::to_string(what).unwrap_or_default() + "\n";
        let written = self.file.write_all(line.as_bytes());
        written.map_err(|e| at(&self.path, e))
    }
}

/// That a file has no trials: they are not dropped unasked.
pub fn vacant(path: &Path) -> Result<(), Error> {
    match count(path) {
        0 => Ok(()),
        trials => Err(wrong(
            path,
            1,
            format!("there are {trials} trials already, and they are not dropped unasked"),
            "go on with --resume; begin anew with --restart, or in another folder with --out",
        )),
    }
}

/// How many whole trials a file has; 0 if there is none.
pub fn count(path: &Path) -> usize {
    let bytes = std::fs::read(path).unwrap_or_default();
    let lines = bytes.iter().filter(|b| **b == b'\n').count();
    lines.saturating_sub(1) // the header
}

fn read<T: for<'a> Deserialize<'a>>(path: &Path, line: usize, text: &str) -> Result<T, Error> {
    serde_json::from_str(text).map_err(|e| {
        wrong(
            path,
            line,
            format!("this is no line of monorig's: {e}"),
            "start anew with --restart",
        )
    })
}

fn wrong(path: &Path, line: usize, message: impl Into<String>, help: &str) -> Error {
    InputError {
        file: path.into(),
        line: Some(line),
        column: Some(1),
        key: String::new(),
        message: message.into(),
        help: help.into(),
    }
    .into()
}

fn at(path: &Path, source: std::io::Error) -> Error {
    Error::Io {
        path: path.into(),
        source,
    }
}
