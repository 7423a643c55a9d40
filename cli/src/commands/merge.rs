//! `monorig merge`: the shards of a study put together.

use crate::CommandOutcome;
use crate::commands::study::print_results;
use crate::ui::errors::CliError;
use crate::ui::note::note;
use monorig_lab::batch;
use std::path::PathBuf;

/// `monorig merge`
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  monorig merge runs/spread/results.*-of-5.jsonl --into runs/spread/results.jsonl"
)]
pub struct MergeArgs {
    /// Results of all shards of a study
    #[arg(required = true)]
    pub parts: Vec<PathBuf>,
    /// File the whole goes to
    #[arg(long, value_name = "FILE")]
    pub into: PathBuf,
}

/// Put the shards of a study together, and print what all runs have come to.
pub fn merge(task: &MergeArgs) -> Result<CommandOutcome, CliError> {
    let runs = batch::merge(&task.parts, &task.into)?;
    note(&format!("{runs} runs in {}", task.into.display()));
    print_results(&task.into)
}
