//! `monorig new-estimator`: a folder with an estimator of one's own, which builds, runs and is tested as it is.

mod rust;

use crate::command::{Command, CommandOutcome, Program};
use crate::ui::errors::CliError;
use crate::ui::output;
use std::path::PathBuf;

const NEW_ESTIMATOR_EXAMPLES: &str = "\
Examples:
  monorig new-estimator rust my_filter
      a crate that has every command of monorig, and the estimator `mine`
  monorig new-estimator rust ~/my_filter --monorig ~/monorig
      away from the sources of monorig";

/// Make a folder with an estimator of your own, a scenario and a test.
#[derive(Debug, clap::Parser)]
#[command(name = "new-estimator", after_help = NEW_ESTIMATOR_EXAMPLES)]
pub struct NewEstimatorArgs {
    /// Language of the estimator
    pub language: Language,
    /// Folder to make; its name is that of the program
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Folder of monorig's sources, which a crate is built with; else the nearest one above this folder or DIR
    #[arg(long, value_name = "DIR")]
    pub monorig: Option<PathBuf>,
}

/// A language that estimators are written in.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
pub enum Language {
    /// A crate
    Rust,
}

impl Command for NewEstimatorArgs {
    fn run(&self, _: &Program<'_>) -> Result<CommandOutcome, CliError> {
        let told = match self.language {
            Language::Rust => rust::make(&self.folder, self.monorig.as_deref())?,
        };
        output::print(&told)?;
        Ok(CommandOutcome::Held)
    }
}
