//! A whole study: recordings, search, validation, sensitivity, files.

use crate::replay::cache::Cache;
use crate::tuning::baseline::Yardstick;
use crate::tuning::evaluate::Bench;
use crate::tuning::report;
use crate::tuning::result::{Done, Trace};
use crate::tuning::search;
use crate::tuning::search::Watcher;
use crate::tuning::sensitivity;
use crate::tuning::sensitivity::Sensitivity;
use crate::tuning::study::{Group, Study};
use crate::tuning::trial_store::Trial;
use crate::tuning::validate;
use crate::tuning::write;
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
    let yardstick = |key, groups, bench: &Bench| Yardstick::new(study, key, groups, bench);
    // before the search, so that runs that measure nothing are refused at once; kept on disk only, not in memory
    let held_out = match bench(&study.validation, "validation runs")? {
        Some(bench) => yardstick("validation", &study.validation, &bench)?,
        None => return Ok(None),
    };
    let Some(tuning) = bench(&study.tuning, "tuning runs")? else {
        return Ok(None);
    };
    let tuned_on = yardstick("tuning", &study.tuning, &tuning)?;
    let store = store_of(&job.folder);
    let watcher = &mut Seat(audience);
    let found = search::search(study, &tuning, &tuned_on, &store, job.resume, watcher)?;
    if !found.finished {
        return Ok(None);
    }
    let Some(winner) = found.winner.and_then(|i| found.trials.get(i)).cloned() else {
        return Ok(Some(Done {
            found,
            validation: None,
            sensitivity: Sensitivity::default(),
            traces: Vec::new(),
            winner: None,
        }));
    };
    let Some(unseen) = bench(&study.validation, "validation runs")? else {
        return Ok(None);
    };
    let validation =
        validate::validate(study, &unseen, &held_out, &winner.parameters, winner.loss());
    let mut go_on = |share| audience.stage("sensitivity", share);
    let Some(sensitivity) =
        sensitivity::sensitivity(study, &tuning, &tuned_on, &winner.parameters, &mut go_on)
    else {
        return Ok(None);
    };
    write::findings(&job.folder, &validation, &sensitivity)?;
    let file = write::winner(study, &found, &validation)?;
    let place = file
        .map(|file| write::whole(&job.folder.join("winner.yaml"), &file.to_yaml()))
        .transpose()?;
    let done = Done {
        found,
        validation: Some(validation),
        sensitivity,
        traces: traces(study, &unseen, &winner),
        winner: place,
    };
    write::whole(&job.folder.join("report.html"), &report::page(study, &done))?;
    Ok(Some(done))
}

/// A run of each validation scenario, for eyes. One that fails is left out.
fn traces(study: &Study, bench: &Bench, winner: &Trial) -> Vec<Trace> {
    let defaults = study.defaults();
    let of = |(i, group): (usize, &Group)| {
        Some(Trace {
            scenario: group.scenario.name.clone(),
            before: bench.trace(i, &defaults).ok()?,
            after: bench.trace(i, &winner.parameters).ok()?,
        })
    };
    study.validation.iter().enumerate().filter_map(of).collect()
}

/// The file of trials in a study's folder.
pub fn store_of(folder: &Path) -> PathBuf {
    folder.join("trials.jsonl")
}
