//! `monorig tune`: search for the parameters of an estimator.

mod recording;
mod table;

use crate::arguments::Tune;
use crate::errors::CliError;
use crate::note::note;
use crate::prepare;
use crate::progress::Progress;
use crate::run::prepare_out;
use crate::{Outcome, interrupt, output};
use monorig_lab::tuning::run;
use monorig_lab::tuning::run::{Audience, Job};
use monorig_lab::tuning::side_by_side;
use monorig_lab::tuning::trial_store::Trial;
use std::num::NonZeroUsize;
use std::sync::{Mutex, PoisonError};

/// Run a study. Nothing is written before the whole input has been found good.
pub fn tune(task: &Tune) -> Result<Outcome, CliError> {
    let study = prepare::tuning(&task.file)?;
    prepare_out(&task.out)?;
    interrupt::listen();
    let folder = task.out.join("tune");
    let cores = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let job = Job {
        folder: folder.join(&study.name),
        cache: task.cache.clone().unwrap_or_else(|| folder.join(".cache")),
        jobs: task.jobs.map_or(cores, NonZeroUsize::get),
        resume: task.resume,
    };
    let shown = Shown {
        name: study.name.clone(),
        progress: Mutex::new(Progress::new(&study.name)),
    };
    let done = run::run(&study, &job, &shown)?;
    let Some(done) = done else {
        return Err(CliError::TuningInterrupted);
    };
    if !task.no_rerun
        && let Some(best) = done.best()
        && let Some(rig) = side_by_side::rig(&study, &best.parameters)?
    {
        recording::write(rig, &job.folder, &mut |share| shown.say("recording", share))?;
    }
    drop(shown);
    note(&format!("results in {}", job.folder.display()));
    output::print(&table::text(&study, &done))?;
    Ok(if done.validation.is_some() {
        Outcome::Held
    } else {
        Outcome::Failed
    })
}

/// Progress of a study.
struct Shown {
    name: String,
    progress: Mutex<Progress>,
}

impl Shown {
    fn say(&self, what: &str, share: f64) -> bool {
        let mut progress = self.progress.lock().unwrap_or_else(PoisonError::into_inner);
        progress.rename(&format!("{}: {what}", self.name));
        progress.at(share);
        interrupt::go_on()
    }
}

impl Audience for Shown {
    fn stage(&self, name: &str, share: f64) -> bool {
        self.say(name, share)
    }

    fn trial(&self, trial: &Trial, best: Option<&Trial>, budget: usize) -> bool {
        let n = trial.trial + 1;
        let best = match best {
            Some(best) => format!("best loss {:.4} (trial {})", best.loss(), best.trial),
            None => "none good yet".to_owned(),
        };
        self.say(
            &format!("trial {n} of {budget}, {best}"),
            n as f64 / budget as f64,
        )
    }
}
