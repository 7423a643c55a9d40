//! The command line, and the help that teaches it.

mod reports;
mod studies;
mod tune;

pub use reports::Report;
pub use studies::{Compare, Merge, Study, Test};
pub use tune::Tune;

use crate::kinds::Kind;
use clap::{Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  monorig run scenarios/liu2023_section1.yaml            simulate; results go to runs/liu2023_section1/1/
  monorig run scenarios/minimal.yaml --set load.mass_kg=5000 --seed 7       another load, another seed
  monorig test scenarios --filter minimal                every scenario over its seeds: does what it expects hold?
  monorig tune scenarios/tuning/quick.yaml               search for the best parameters of an estimator
  monorig report runs/liu2023_section1/1                 plots, errors and verdicts of a run as one HTML file
  monorig check scenarios/*.yaml                         find mistakes without running
  monorig schema scenario                                every key a scenario can have

Exit codes: 0 all held, 1 an expectation failed, 2 could not run (bad input, files).";

/// A physics-simulated test rig for the mass and slope estimators of monorail cranes.
#[derive(Debug, Parser)]
#[command(name = "monorig", version, after_help = EXAMPLES, arg_required_else_help = true, max_term_width = 100)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub task: Task,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Task {
    /// Simulate a scenario: train, sensors, estimators and controller in closed loop
    Run(Run),
    /// Run scenarios over their seeds and judge what they expect
    Test(Test),
    /// Run estimators side by side over the seeds of a scenario and compare their metrics
    Compare(Compare),
    /// Run a scenario many times with drawn values (Monte Carlo); a study that was stopped goes on
    Study(Study),
    /// Put the shards of a study together
    Merge(Merge),
    /// Search for the parameters of an estimator that are best over many runs
    Tune(Tune),
    /// Write a report as one HTML file
    Report(Report),
    /// Check files without running anything
    Check(Check),
    /// Print the JSON Schema of a file format: every key, its meaning and its unit
    Schema(Schema),
}

const RUN_EXAMPLES: &str = "\
Examples:
  monorig run scenarios/liu2023_section1.yaml
  monorig run scenarios/minimal.yaml --seed 7 --set 'drive.speed[2].mps=0.5' --set 'estimators.joint_ekf_robust={}'
  monorig run scenarios/minimal.yaml --plant point-mass --no-rerun   fast: a point on the rail, no 3-D recording

Results: OUT/<scenario>/<seed>/ with manifest.json (what was run), channels.parquet (every signal),
metrics.json, and run.rrd to open in the Rerun viewer.";

/// `monorig run`
#[derive(Debug, clap::Args)]
#[command(after_help = RUN_EXAMPLES)]
pub struct Run {
    /// Scenario file
    pub file: PathBuf,
    /// Run this seed instead of the scenario's first
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Folder the results go to
    #[arg(long, value_name = "DIR", default_value = "runs")]
    pub out: PathBuf,
    /// Also stream to a Rerun viewer that is open on this machine
    #[arg(long, conflicts_with = "no_rerun")]
    pub live: bool,
    /// Do not write run.rrd
    #[arg(long)]
    pub no_rerun: bool,
    /// Move the train with this plant instead of the scenario's
    #[arg(long, value_name = "PLANT")]
    pub plant: Option<Plant>,
    /// Change a value of the scenario; may be given several times
    #[arg(long = "set", value_name = "PATH=VALUE", value_parser = assignment)]
    pub sets: Vec<(String, String)>,
}

impl Run {
    /// All changes to the scenario as `(path, value)`.
    pub fn overrides(&self) -> Vec<(String, String)> {
        let mut all = self.sets.clone();
        if let Some(seed) = self.seed {
            all.push(("seeds".into(), seed.to_string()));
        }
        if let Some(plant) = self.plant {
            let word = match plant {
                Plant::Rapier => "rapier",
                Plant::PointMass => "point-mass",
            };
            all.push(("physics.plant".into(), word.into()));
        }
        all
    }
}

const CHECK_EXAMPLES: &str = "\
Examples:
  monorig check scenarios/*.yaml                a scenario with everything it names, as before a run
  monorig check assets/*/*.yaml                 tracks, trains, units, sensor sheets, rail profiles by themselves
  monorig check --kind track assets/tracks/winding.yaml
  monorig check runs/liu2023_section1/1/*       what a run left behind: whole and readable?";

/// `monorig check`
#[derive(Debug, clap::Args)]
#[command(after_help = CHECK_EXAMPLES)]
pub struct Check {
    /// Files to check; their kind is told from their keys, of results from their names
    #[arg(required = true)]
    pub files: Vec<PathBuf>,
    /// What the files are, if it cannot be told from their keys
    #[arg(long)]
    pub kind: Option<Kind>,
}

/// `monorig schema`
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  monorig schema                   the kinds there are\n  monorig schema scenario > scenario.json"
)]
pub struct Schema {
    /// Kind of file; without it the kinds are listed
    pub kind: Option<Kind>,
}

/// What moves the train.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Plant {
    /// Rigid bodies in rapier
    Rapier,
    /// A point on the rail
    PointMass,
}

fn assignment(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((path, value)) if !path.trim().is_empty() => {
            Ok((path.trim().to_owned(), value.to_owned()))
        }
        _ => Err("write PATH=VALUE, such as load.mass_kg=5000".to_owned()),
    }
}
