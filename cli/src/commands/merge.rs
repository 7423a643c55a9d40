//! `monorig merge`: the shards of a study, of a test or of a stress battery put together.

use crate::arguments::Json;
use crate::command::{Command, CommandOutcome, Program};
use crate::identity::identity;
use crate::ui::errors::CliError;
use crate::ui::note::note;
use crate::ui::output;
use crate::ui::terminal;
use crate::verdicts::lines;
use crate::verdicts::stress::print_matrix;
use crate::verdicts::study::print_results;
use monorig_lab::batch::{self, test_shards};
use monorig_lab::stress::{StressFile, merge_stress};
use monorig_lab::verdicts::verdict::ScenarioVerdict;
use std::path::PathBuf;

/// Put the shards of a study together.
#[derive(Debug, clap::Parser)]
#[command(
    name = "merge",
    after_help = "Examples:
  monorig merge runs/spread/results.*-of-5.jsonl --into runs/spread/results.jsonl      shards of a study
  monorig merge shard-*.json --into verdicts.json                                      shards of `monorig test --shard K/N --json FILE`
  monorig merge shard-*.json --into stress.json                                        shards of `monorig stress --shard K/N --json FILE`

Shards of another program, of other files, or made on a machine that computes other bits are refused."
)]
pub struct MergeArgs {
    /// Results of all shards of a study, a test or a stress battery
    #[arg(required = true)]
    pub parts: Vec<PathBuf>,
    /// File the whole goes to; of a test `-` is standard output
    #[arg(long, value_name = "FILE")]
    pub into: PathBuf,
}

impl Command for MergeArgs {
    fn run(&self, _: &Program<'_>) -> Result<CommandOutcome, CliError> {
        merge(self)
    }
}

/// Put the shards together, and print what all runs have come to.
fn merge(task: &MergeArgs) -> Result<CommandOutcome, CliError> {
    let of_test = |path: &PathBuf| {
        path.extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("json"))
    };
    let first = task.parts.first();
    if first.is_some_and(|path| StressFile::is_one(path)) {
        let file = merge_stress(&task.parts, &task.into)?;
        output::write(&task.into, &file.to_json())?;
        print_matrix(&file, terminal::verbose())?;
        return Ok(CommandOutcome::Held);
    }
    if first.is_some_and(of_test) {
        return merge_tests(task);
    }
    let runs = batch::merge(&task.parts, &task.into)?;
    note(&format!("{runs} runs in {}", task.into.display()));
    print_results(&task.into, &Json::default())
}

/// Judge the shards of a test together, and write what `monorig test --json` would have written for the whole.
fn merge_tests(task: &MergeArgs) -> Result<CommandOutcome, CliError> {
    let verdicts = test_shards::merge_tests(&task.parts, &task.into)?;
    let all: Vec<&ScenarioVerdict> = verdicts.iter().collect();
    let json = test_shards::json(&all, &identity(), None);
    let text = serde_json::to_string_pretty(&json).map_err(CliError::json)?;
    output::write(&task.into, &(text + "\n"))?;
    let programs = [Some(task.into.as_path())];
    let width = all.iter().map(|v| v.scenario.chars().count()).max();
    for verdict in &verdicts {
        let line = lines::line(verdict, None, width.unwrap_or(0));
        output::result(&line, &programs)?;
    }
    let details = verdicts.iter().map(|v| lines::detail(v, None, &[]));
    let details: Vec<String> = details.filter(|d| !d.is_empty()).collect();
    output::result(&lines::end(&all, &details.join("\n"), 0), &programs)?;
    Ok(match verdicts.iter().filter(|v| !v.held).count() {
        0 => CommandOutcome::Held,
        _ => CommandOutcome::Failed,
    })
}
