//! `monorig study`: many runs with drawn values, results line by line, whole or in shards.

use crate::arguments::{Expect, Jobs, Json, Out, shard};
use crate::command::{Command, CommandOutcome, Program};
use crate::files::prepare;
use crate::identity::identity;
use crate::recording::many::resumed;
use crate::ui::errors::CliError;
use crate::ui::note::note;
use crate::ui::{interrupt, output};
use crate::verdicts::study::print_results;
use monorig_lab::batch::run_one;
use monorig_lab::campaign::Shard;
use monorig_sim::closed_loop::registry::Registry;
use std::path::PathBuf;

const STUDY_EXAMPLES: &str = "\
Examples:
  monorig study scenarios/studies/vehicle_test_spread.yaml
      results go to runs/vehicle_test_spread/results.jsonl
  monorig study scenarios/studies/vehicle_test_spread.yaml --shard 2/5
      every fifth run, for one of five machines
  monorig study spread.yaml --shard 2/5 --expect merge
      the same for a scheduler: exit code 0 once its runs are made
  monorig merge runs/vehicle_test_spread/results.*-of-5.jsonl --into all.jsonl

Stopped or killed, it goes on where it was when it is started again, if program
and input files are the same (copies of these are kept in OUT/<study>/inputs).
The results are the same bytes whatever --jobs, whether it was interrupted or
not, and whether it was run whole or in shards and merged.";

/// Run a scenario many times with drawn values (Monte Carlo).
#[derive(Debug, clap::Parser)]
#[command(name = "study", after_help = STUDY_EXAMPLES)]
pub struct StudyArgs {
    /// Study file
    pub file: PathBuf,
    #[command(flatten)]
    pub jobs: Jobs,
    /// Make only part K of N of the runs
    #[arg(long, value_name = "K/N", value_parser = shard)]
    pub shard: Option<Shard>,
    /// Who judges the expectations
    #[arg(
        long,
        value_name = "WHO",
        value_enum,
        default_value_t,
        requires_if("merge", "shard")
    )]
    pub expect: Expect,
    #[command(flatten)]
    pub out: Out,
    #[command(flatten)]
    pub json: Json,
}

impl Command for StudyArgs {
    fn run(&self, program: &Program<'_>) -> Result<CommandOutcome, CliError> {
        study(self, program.registry)
    }
}

/// Make the runs that are not there yet, then print what all of them have come to.
fn study(task: &StudyArgs, registry: &Registry) -> Result<CommandOutcome, CliError> {
    let plan = prepare::study(&task.file, registry)?;
    output::begin()?;
    let campaign = plan.campaign(&identity()).part(task.shard);
    let folder = task.out.get().join(&plan.name);
    let work = |index| run_one(&plan.spec(index), registry, &interrupt::go_on);
    let path = resumed(&campaign, &folder, plan.inputs(), task.jobs, work, |_| ())?;
    note(&format!("results in {}", path.display()));
    print_results(&path, &task.json).map(|judged| task.expect.outcome(judged))
}
