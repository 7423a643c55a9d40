//! A whole study: recordings, search, validation, sensitivity, files.

use super::evaluate::Bench;
use super::search::{self, Found, Watcher};
use super::sensitivity::{self, Sensitivity};
use super::store::Trial;
use super::study::{Group, Study};
use super::validate::{self, Validation};
use super::write;
use crate::replay::cache::Cache;
use monorig_sim::error::Error;
use std::path::{Path, PathBuf};

/// What to do, and where.
#[derive(Clone, Debug)]
pub struct Job {
    /// Folder of the results.
    pub folder: PathBuf,
    /// Folder of the recordings.
    pub cache: PathBuf,
    /// Threads.
    pub jobs: usize,
    /// Go on with the trials that are there.
    pub resume: bool,
}

/// What a study has found.
pub struct Done {
    /// The trials.
    pub found: Found,
    /// The winner on unseen runs; none without a winner.
    pub validation: Option<Validation>,
    /// Its neighbourhood.
    pub sensitivity: Sensitivity,
    /// The parameter file.
    pub winner: Option<PathBuf>,
}

/// Someone who watches a study. Asked from several threads.
pub trait Audience: Sync {
    /// A stage has come to this share of its way, 0…1. Says whether to go on.
    fn stage(&self, name: &str, share: f64) -> bool;
    /// A trial is judged; `best` is the best so far. Says whether to go on.
    fn trial(&self, trial: &Trial, best: Option<&Trial>, budget: usize) -> bool;
}

struct Seat<'a>(&'a dyn Audience);

impl Watcher for Seat<'_> {
    fn trial(&mut self, trial: &Trial, best: Option<&Trial>, budget: usize) -> bool {
        self.0.trial(trial, best, budget)
    }
}

/// Run a study. None if the audience stopped it: what is in the store stays, and the study can be resumed.
pub fn run(study: &Study, job: &Job, audience: &dyn Audience) -> Result<Option<Done>, Error> {
    std::fs::create_dir_all(&job.folder).map_err(|source| Error::Io {
        path: job.folder.clone(),
        source,
    })?;
    let cache = Cache::new(&job.cache);
    let bench = |groups: &[Group], stage: &str| {
        let go_on = |share| audience.stage(stage, share);
        Bench::prepare(study, groups, &cache, job.jobs, &go_on)
    };
    let Some(tuning) = bench(&study.tuning, "tuning runs")? else {
        return Ok(None);
    };
    let store = store_of(&job.folder);
    let found = search::search(study, &tuning, &store, job.resume, &mut Seat(audience))?;
    if !found.finished {
        return Ok(None);
    }
    let Some(winner) = found.winner.and_then(|i| found.trials.get(i)).cloned() else {
        return Ok(Some(Done {
            found,
            validation: None,
            sensitivity: Sensitivity::default(),
            winner: None,
        }));
    };
    let Some(held_out) = bench(&study.validation, "validation runs")? else {
        return Ok(None);
    };
    let validation = validate::validate(study, &held_out, &winner.parameters, winner.loss());
    let mut go_on = |share| audience.stage("sensitivity", share);
    let Some(sensitivity) =
        sensitivity::sensitivity(study, &tuning, &winner.parameters, &mut go_on)
    else {
        return Ok(None);
    };
    write::findings(&job.folder, &validation, &sensitivity)?;
    let file = write::winner(study, &found, &validation)?;
    let place = file
        .map(|file| write::whole(&job.folder.join("winner.yaml"), &file.to_yaml()))
        .transpose()?;
    Ok(Some(Done {
        found,
        validation: Some(validation),
        sensitivity,
        winner: place,
    }))
}

/// The file of trials in a study's folder.
pub fn store_of(folder: &Path) -> PathBuf {
    folder.join("trials.jsonl")
}
