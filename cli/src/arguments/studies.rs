//! Tasks that make many runs.

use monorig_lab::batch::Shard;
use monorig_lab::metrics::METRICS;
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

const COMPARE_EXAMPLES: &str = "\
Examples:
  monorig compare scenarios/liu2023_section1.yaml --estimators dffrls_aekf,rls_ekf,joint_ekf --seeds 1..50
  monorig compare scenarios/liu2023_section1.yaml --metrics mass_rmse_kg,slope_rmse_deg --csv table.csv

All estimators run in the same runs on the same measurements; `in_loop` stays what the scenario says. Differences to
the reference are taken run by run. Intervals: 95 %, percentile bootstrap over seeds.";

/// `monorig compare`
#[derive(Debug, clap::Args)]
#[command(after_help = COMPARE_EXAMPLES)]
pub struct Compare {
    /// Scenario file
    pub file: PathBuf,
    /// Estimators to compare; without it those of the scenario
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub estimators: Vec<String>,
    /// Run these seeds instead of the scenario's own: `7`, `1..50` or `1,5,9`
    #[arg(long, value_name = "SEEDS", value_parser = seeds)]
    pub seeds: Option<String>,
    /// Metrics to compare
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = metric,
        default_value = "mass_rmse_kg,mass_error_converged_rel_max,slope_rmse_deg,slope_mae_deg,slope_valid_share")]
    pub metrics: Vec<String>,
    /// Estimator that the others are held against; without it the first
    #[arg(long, value_name = "NAME")]
    pub reference: Option<String>,
    #[command(flatten)]
    pub jobs: Jobs,
    /// Write table and runs as JSON
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write the table as CSV
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
}

/// A metric of estimators by its name.
fn metric(name: &str) -> Result<String, String> {
    let known = METRICS.iter().map(|m| m.name);
    if known.clone().any(|k| k == name) {
        return Ok(name.to_owned());
    }
    let list: Vec<&str> = known.clone().collect();
    Err(match monorig_sim::file::nearest(name, known) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("known metrics: {}", list.join(", ")),
    })
}

const STUDY_EXAMPLES: &str = "\
Examples:
  monorig study scenarios/studies/vehicle_test_spread.yaml           results go to runs/vehicle_test_spread/results.jsonl
  monorig study scenarios/studies/vehicle_test_spread.yaml --shard 2/5      every fifth run, for one of five machines
  monorig merge runs/vehicle_test_spread/results.*-of-5.jsonl --into all.jsonl

Stopped or killed, it goes on where it was when it is started again. The results are the same bytes whatever --jobs,
whether it was interrupted or not, and whether it was run whole or in shards and merged.";

/// `monorig study`
#[derive(Debug, clap::Args)]
#[command(after_help = STUDY_EXAMPLES)]
pub struct Study {
    /// Study file
    pub file: PathBuf,
    #[command(flatten)]
    pub jobs: Jobs,
    /// Make only part K of N of the runs
    #[arg(long, value_name = "K/N", value_parser = shard)]
    pub shard: Option<Shard>,
    /// Folder the results go to
    #[arg(long, value_name = "DIR", default_value = "runs")]
    pub out: PathBuf,
}

/// `monorig merge`
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  monorig merge runs/spread/results.*-of-5.jsonl --into runs/spread/results.jsonl"
)]
pub struct Merge {
    /// Results of all shards of a study
    #[arg(required = true)]
    pub parts: Vec<PathBuf>,
    /// File the whole goes to
    #[arg(long, value_name = "FILE")]
    pub into: PathBuf,
}

fn shard(text: &str) -> Result<Shard, String> {
    let parsed = text.split_once('/').and_then(|(part, of)| {
        let (part, of) = (part.trim().parse().ok()?, of.trim().parse().ok()?);
        (1..=of).contains(&part).then_some(Shard { part, of })
    });
    parsed.ok_or_else(|| "write K/N with K from 1 to N, such as 2/5".to_owned())
}
