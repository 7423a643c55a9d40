//! `monorig tune`: search for the parameters of an estimator.

mod table;

use crate::arguments::{Jobs, Json, Out};
use crate::command::{Command, CommandOutcome, Program};
use crate::files::out::prepare_out;
use crate::files::prepare;
use crate::files::share;
use crate::identity::identity;
use crate::ui::errors::CliError;
use crate::ui::interrupt;
use crate::ui::note::note;
use crate::ui::output;
use crate::ui::progress::ProgressDisplay;
use monorig_lab::tuning::progress::Progress;
use monorig_lab::tuning::run::{self, Ended, TuningRun};
use monorig_lab::tuning::search::Begin;
use monorig_lab::tuning::trial_store::Trial;
use monorig_sim::closed_loop::registry::Registry;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

const EXAMPLES: &str = "\
Examples:
  monorig tune scenarios/tuning/quick.yaml
      search; results go to runs/tune/quick/
  monorig tune scenarios/tuning/quick.yaml --resume
      continue after an interruption, with the same results
  monorig check scenarios/tuning/*.yaml
      find mistakes in studies without running them

Results: OUT/tune/<study>/ with report.html (read this), trials.jsonl (every
trial), winner.yaml (for `estimators: {x: {from: winner.yaml}}`),
validation.json and sensitivity.json.";

/// Search for the best parameters of an estimator over many runs.
#[derive(Debug, clap::Parser)]
#[command(name = "tune", after_help = EXAMPLES)]
pub struct TuneArgs {
    /// Study file
    #[arg(value_parser = share::named())]
    pub file: PathBuf,
    /// Continue after the existing trials
    #[arg(long)]
    pub resume: bool,
    /// Drop the existing trials, and start anew
    #[arg(long, conflicts_with = "resume")]
    pub restart: bool,
    #[command(flatten)]
    pub jobs: Jobs,
    #[command(flatten)]
    pub out: Out,
    /// Folder of the recorded runs [default: OUT/tune/.cache]
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    #[command(flatten)]
    pub json: Json,
}

impl Command for TuneArgs {
    fn run(&self, program: &Program<'_>) -> Result<CommandOutcome, CliError> {
        tune(self, program.registry)
    }
}

/// Run a study. Nothing is written before the whole input is checked.
fn tune(task: &TuneArgs, registry: &Registry) -> Result<CommandOutcome, CliError> {
    let study = prepare::tuning(&task.file, registry)?;
    let out = task.out.get();
    prepare_out(&out)?;
    output::begin()?;
    let folder = out.join("tune");
    let tuning = TuningRun {
        folder: folder.join(&study.name),
        cache: task.cache.clone().unwrap_or_else(|| folder.join(".cache")),
        jobs: task.jobs.get().get(),
        begin: match (task.resume, task.restart) {
            (true, _) => Begin::Resume,
            (_, true) => Begin::Restart,
            _ => Begin::New,
        },
        monorig: identity(),
    };
    let progress = TuningProgress {
        name: study.name.clone(),
        progress: Mutex::new(ProgressDisplay::new(&study.name)),
    };
    let result = match run::run(&study, &tuning, &progress)? {
        Ended::Finished(result) => result,
        Ended::Interrupted(trials) => return Err(CliError::TuningInterrupted(trials)),
    };
    drop(progress);
    note(&format!("results in {}", tuning.folder.display()));
    task.json
        .write(|| table::json(&study, &result, &tuning.folder))?;
    let text = table::text(&study, &result, &tuning.folder);
    output::result(&text, &[task.json.path()])?;
    Ok(CommandOutcome::of(result.validation.is_some()))
}

/// Progress of a tuning run on the terminal.
struct TuningProgress {
    name: String,
    progress: Mutex<ProgressDisplay>,
}

impl TuningProgress {
    fn show(&self, what: &str, share: f64) -> bool {
        let mut progress = self.progress.lock().unwrap_or_else(PoisonError::into_inner);
        progress.rename(&format!("{}: {what}", self.name));
        progress.at(share);
        interrupt::go_on()
    }
}

impl Progress for TuningProgress {
    fn stage(&self, name: &str, share: f64) -> bool {
        self.show(name, share)
    }

    fn trial(&self, trial: &Trial, best: Option<&Trial>, budget: usize) -> bool {
        let n = trial.trial + 1;
        let best = match best {
            Some(best) => format!("best loss {:.4} (trial {})", best.loss(), best.trial),
            None => "no good trial yet".to_owned(),
        };
        self.show(
            &format!("trial {n} of {budget}, {best}"),
            n as f64 / budget as f64,
        )
    }
}
