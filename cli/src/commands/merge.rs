//! `monorig merge`: the shards of a study or of a test put together.

use crate::command::{Command, CommandOutcome, Program};
use crate::ui::errors::CliError;
use crate::ui::note::note;
use crate::verdicts::shards;
use crate::verdicts::study::print_results;
use monorig_lab::batch;
use std::path::PathBuf;

/// Put the shards of a study together.
#[derive(Debug, clap::Parser)]
#[command(
    name = "merge",
    after_help = "Examples:
  monorig merge runs/spread/results.*-of-5.jsonl --into runs/spread/results.jsonl      shards of a study
  monorig merge shard-*.json --into verdicts.json                                      shards of `monorig test --shard K/N --json FILE`

Shards of another program, of other files, or made on a machine that computes other bits are refused."
)]
pub struct MergeArgs {
    /// Results of all shards of a study, or of a test
    #[arg(required = true)]
    pub parts: Vec<PathBuf>,
    /// File the whole goes to
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
    if task.parts.first().is_some_and(of_test) {
        return shards::merge(&task.parts, &task.into);
    }
    let runs = batch::merge(&task.parts, &task.into)?;
    note(&format!("{runs} runs in {}", task.into.display()));
    print_results(&task.into)
}
