//! `monorig merge`: the shards of a study or of a test put together.

use crate::CommandOutcome;
use crate::commands::study::print_results;
use crate::commands::test::shards;
use crate::ui::errors::CliError;
use crate::ui::note::note;
use monorig_lab::batch;
use std::path::PathBuf;

/// `monorig merge`
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  monorig merge runs/spread/results.*-of-5.jsonl --into runs/spread/results.jsonl      shards of a study
  monorig merge shard-*.json --into verdicts.json                                      shards of `monorig test --shard K/N --json FILE`

Shards of another program, of other files, or made on a machine that computes other bits are refused.")]
pub struct MergeArgs {
    /// Results of all shards of a study, or of a test
    #[arg(required = true)]
    pub parts: Vec<PathBuf>,
    /// File the whole goes to
    #[arg(long, value_name = "FILE")]
    pub into: PathBuf,
}

/// Put the shards together, and print what all runs have come to.
pub fn merge(task: &MergeArgs) -> Result<CommandOutcome, CliError> {
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
