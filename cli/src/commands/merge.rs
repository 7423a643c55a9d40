//! `monorig merge`: join the shards of a study, of a test or of a stress battery.

use crate::arguments::Json;
use crate::command::{Command, CommandOutcome, Program};
use crate::ui::errors::CliError;
use crate::ui::note::note;
use crate::ui::output;
use crate::ui::terminal;
use crate::verdicts::stress::{judge_matrix, print_matrix};
use crate::verdicts::study::print_results;
use crate::verdicts::{self, lines};
use monorig_lab::batch::judged;
use monorig_lab::campaign::{self, Campaign, CampaignKind, Shards};
use monorig_lab::stress::{StressFile, StressRun};
use monorig_lab::verdicts::run_result::RunResult;
use monorig_lab::verdicts::verdict::ScenarioVerdict;
use monorig_sim::error::Error;
use std::path::PathBuf;

/// Join the shards of a study, a test or a stress battery.
#[derive(Debug, clap::Parser)]
#[command(
    name = "merge",
    after_help = "Examples:
  monorig merge runs/spread/results.*-of-5.jsonl --into runs/spread/results.jsonl      shards of a study
  monorig merge shard-*.jsonl --into verdicts.json                                     shards of `monorig test --shard K/N --json FILE`
  monorig merge shard-*.jsonl --into stress.json                                       shards of `monorig stress --shard K/N --json FILE`

Shards of another program, of other files, or made on a machine that computes other bits are refused."
)]
pub struct MergeArgs {
    /// Results of all shards of a study, a test or a stress battery
    #[arg(required = true)]
    pub parts: Vec<PathBuf>,
    /// File for the joined results; for a test `-` is standard output
    #[arg(long, value_name = "FILE")]
    pub into: PathBuf,
}

impl Command for MergeArgs {
    fn run(&self, _: &Program<'_>) -> Result<CommandOutcome, CliError> {
        merge(self)
    }
}

/// Join the shards, and print the results of all runs.
fn merge(task: &MergeArgs) -> Result<CommandOutcome, CliError> {
    let (parts, into) = (&task.parts, &task.into);
    let kind = match parts.first() {
        Some(first) => Campaign::read(first)?.kind,
        None => CampaignKind::Study,
    };
    match kind {
        CampaignKind::Test => merge_tests(task),
        CampaignKind::Stress => {
            let mut shards = Shards::<StressRun>::open(parts, kind)?;
            let runs: Result<_, Error> = shards.by_ref().map(|row| Ok(row?.1)).collect();
            let file = StressFile::new(shards.campaign(), runs?);
            output::write(into, &file.to_json())?;
            print_matrix(&file, terminal::verbose())?;
            output::verdicts(&format!("{}\n", judge_matrix(&file, None, false)?.1))?;
            Ok(CommandOutcome::Held)
        }
        CampaignKind::Study | CampaignKind::Tune => {
            let shards = Shards::<RunResult>::open(parts, CampaignKind::Study)?;
            let runs = campaign::merge(shards, into)?;
            note(&format!("{runs} runs in {}", into.display()));
            print_results(into, &Json::default())
        }
    }
}

/// Judge the shards of a test together, and write the file that `monorig test --json` would write for all runs.
fn merge_tests(task: &MergeArgs) -> Result<CommandOutcome, CliError> {
    let shards = Shards::<RunResult>::open(&task.parts, CampaignKind::Test)?;
    let campaign = shards.campaign().clone();
    let verdicts = judged(&campaign, shards)?;
    let all: Vec<&ScenarioVerdict> = verdicts.iter().collect();
    let json = serde_json::to_string_pretty(&verdicts::json(verdicts.iter()));
    output::write(&task.into, &(json.map_err(CliError::json)? + "\n"))?;
    let programs = [Some(task.into.as_path())];
    let width = all.iter().map(|v| v.scenario.chars().count()).max();
    for verdict in &verdicts {
        let line = lines::line(verdict, None, width.unwrap_or(0));
        output::result(&line, &programs)?;
    }
    let details = verdicts.iter().map(|v| lines::detail(v, None, &[]));
    let details: Vec<String> = details.filter(|d| !d.is_empty()).collect();
    output::result(&lines::end(&all, &details.join("\n"), 0), &programs)?;
    Ok(CommandOutcome::of(verdicts.iter().all(|v| v.held)))
}
