//! Tasks that make many runs.

use std::num::NonZeroUsize;
use std::path::PathBuf;

/// Threads to work with.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct Jobs {
    /// Runs at a time; without it as many as there are cores. Results do not depend on it
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
}

impl Jobs {
    /// How many.
    pub fn get(self) -> NonZeroUsize {
        self.jobs
            .unwrap_or_else(|| std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN))
    }
}

const TEST_EXAMPLES: &str = "\
Examples:
  monorig test                                           every scenario in scenarios/, each over its seeds
  monorig test scenarios/liu2023_section1.yaml --seeds 1..50
  monorig test scenarios --filter liu2023 --junit report.xml --json report.json

A scenario fails when a run does not finish, when an estimator never vouches for anything, or when an expectation
does not hold for as many seeds as it asks for (`quantile`; all without it).";

/// `monorig test`
#[derive(Debug, clap::Args)]
#[command(after_help = TEST_EXAMPLES)]
pub struct Test {
    /// Scenario files, or folders of them
    #[arg(default_value = "scenarios")]
    pub paths: Vec<PathBuf>,
    #[command(flatten)]
    pub jobs: Jobs,
    /// Only scenarios with this text in their name
    #[arg(long, value_name = "TEXT")]
    pub filter: Option<String>,
    /// Run these seeds instead of the scenarios' own: `7`, `1..50` or `1,5,9`
    #[arg(long, value_name = "SEEDS", value_parser = seeds)]
    pub seeds: Option<String>,
    /// Write the verdicts as JUnit XML, as CI servers read it
    #[arg(long, value_name = "FILE")]
    pub junit: Option<PathBuf>,
    /// Write verdicts and metrics of every run as JSON
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

/// Seeds as a scenario would write them.
fn seeds(text: &str) -> Result<String, String> {
    let yaml = if text.contains(',') {
        format!("[{text}]")
    } else {
        text.to_owned()
    };
    monorig_sim::scenario::Seeds::parse(&yaml)?;
    Ok(yaml)
}
