//! A tuning study from end to end: recordings, search, validation, sensitivity, files.

use crate::replay::cache::Cache;
use crate::tuning::baseline::Baseline;
use crate::tuning::evaluate::{Evaluator, Means, Stage};
use crate::tuning::progress::Progress;
use crate::tuning::report;
use crate::tuning::result::{Trace, TuningResult};
use crate::tuning::search::{Begin, search};
use crate::tuning::sensitivity::{Sensitivity, sensitivity};
use crate::tuning::study::{RunGroup, TuningStudy};
use crate::tuning::trial_store::{self, Trial};
use crate::tuning::validate;
use crate::tuning::write;
use monorig_sim::error::Error;
use monorig_sim::record::identity::Identity;
use std::path::{Path, PathBuf};

/// Task of a tuning run: folders, threads, begin.
#[derive(Clone, Debug)]
pub struct TuningRun {
    /// Folder of the results.
    pub folder: PathBuf,
    /// Folder of the recordings.
    pub cache: PathBuf,
    /// Threads.
    pub jobs: usize,
    /// Treatment of existing trials.
    pub begin: Begin,
    /// Program that runs the study.
    pub monorig: Identity,
}

/// End of a study.
pub enum Ended {
    /// The study finished.
    Finished(Box<TuningResult>),
    /// The study was stopped with this number of trials in its store.
    Interrupted(usize),
}

/// Run a study. If `progress` stopped it, what is in the store stays, and the study can be resumed.
pub fn run(study: &TuningStudy, run: &TuningRun, progress: &dyn Progress) -> Result<Ended, Error> {
    let store = store_of(&run.folder);
    match finished(study, run, &store, progress)? {
        Some(result) => Ok(Ended::Finished(Box::new(result))),
        None => Ok(Ended::Interrupted(trial_store::count(&store))),
    }
}

/// `None` if the run was stopped.
fn finished(
    study: &TuningStudy,
    run: &TuningRun,
    store: &Path,
    progress: &dyn Progress,
) -> Result<Option<TuningResult>, Error> {
    if run.begin == Begin::New {
        trial_store::vacant(store)?; // found out before anything is recorded
    }
    let cache = Cache::new(&run.cache, &run.monorig);
    std::fs::create_dir_all(&run.folder).map_err(Error::at(&run.folder))?;
    let means = Means {
        cache: &cache,
        jobs: run.jobs,
    };
    let evaluator = |stage| Evaluator::prepare(study, stage, means, progress);
    let baseline =
        |key, groups, evaluator: &Evaluator<'_>| Baseline::new(study, key, groups, evaluator);
    // before the search, so that runs that measure nothing are refused at once; kept on disk only, not in memory
    let held_out = match evaluator(Stage::Validation)? {
        Some(evaluator) => baseline("validation", &study.validation, &evaluator)?,
        None => return Ok(None),
    };
    let Some(tuning) = evaluator(Stage::Tuning)? else {
        return Ok(None);
    };
    let tuned_on = baseline("tuning", &study.tuning, &tuning)?;
    let store = (store, run.begin);
    let search = search(study, &tuning, &tuned_on, store, &run.monorig, progress)?;
    if !search.finished {
        return Ok(None);
    }
    let Some(winner) = search.winner.and_then(|i| search.trials.get(i)).cloned() else {
        return Ok(Some(TuningResult {
            search,
            validation: None,
            sensitivity: Sensitivity::default(),
            traces: Vec::new(),
        }));
    };
    let Some(unseen) = evaluator(Stage::Validation)? else {
        return Ok(None);
    };
    let validation =
        validate::validate(study, &unseen, &held_out, &winner.parameters, winner.loss());
    let Some(sensitivity) = sensitivity(study, &tuning, &tuned_on, &winner.parameters, progress)
    else {
        return Ok(None);
    };
    write::findings(&run.folder, &validation, &sensitivity)?;
    let file = write::winner(study, &search, &validation, &run.monorig);
    if let Some(file) = file {
        write::whole(&run.folder.join("winner.yaml"), &file.to_yaml())?;
    }
    let result = TuningResult {
        search,
        validation: Some(validation),
        sensitivity,
        traces: traces(study, &unseen, &winner),
    };
    write::whole(
        &run.folder.join("report.html"),
        &report::page(study, &result),
    )?;
    Ok(Some(result))
}

/// A run of each validation scenario, for plots. One that fails is left out.
fn traces(study: &TuningStudy, evaluator: &Evaluator<'_>, winner: &Trial) -> Vec<Trace> {
    let defaults = study.defaults();
    let of = |(i, group): (usize, &RunGroup)| {
        Some(Trace {
            scenario: group.scenario.name.clone(),
            before: evaluator.trace(i, &defaults).ok()?,
            after: evaluator.trace(i, &winner.parameters).ok()?,
        })
    };
    study.validation.iter().enumerate().filter_map(of).collect()
}

/// The file of trials in a study's folder.
pub(crate) fn store_of(folder: &Path) -> PathBuf {
    folder.join("trials.jsonl")
}
