//! The commands, a file each: its arguments with their help, and what it does.

pub mod bound;
pub mod calibrate;
pub mod check;
pub mod compare;
pub mod completions;
pub mod draw;
pub mod explain;
pub mod export;
pub mod inspect;
pub mod judge;
pub mod list;
pub mod map;
pub mod merge;
pub mod replay;
pub mod report;
pub mod run;
pub mod runs;
pub mod schema;
pub mod sensors;
pub mod shared;
mod standing_noise;
pub mod study;
pub mod test;
pub mod tune;

use crate::CommandOutcome;
use crate::identity::identity;
use crate::ui::errors::CliError;
use crate::ui::terminal::TerminalArgs;
use clap::{Parser, Subcommand};
use monorig_sim::closed_loop::registry::Registry;
use std::sync::OnceLock;

const EXAMPLES: &str = "\
Examples:
  monorig run scenarios/minimal.yaml           simulate: see runs/minimal/1/
  monorig run scenarios/minimal.yaml --set load.mass_kg=5000 --seed 7
  monorig test scenarios --filter minimal      does what it expects hold?
  monorig tune scenarios/tuning/quick.yaml     search for the best parameters
  monorig report runs/minimal/1                plots and verdicts, one HTML file
  monorig list estimators                      also metrics, faults, scenarios …
  monorig runs                                 the runs there are, and variants
  monorig check scenarios/*.yaml               find mistakes without running
  monorig schema scenario                      every key a scenario can have

Exit codes: 0 all held, 1 an expectation failed, 2 could not run (bad input,
files).";

/// A physics-simulated test rig for the mass and slope estimators of monorail cranes.
#[derive(Debug, Parser)]
#[command(name = "monorig", version, after_help = EXAMPLES, arg_required_else_help = true, max_term_width = 100)]
pub struct Arguments {
    #[command(flatten)]
    pub terminal: TerminalArgs,
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What `--version` says: the version, the git revision, and the hash of the program, computed only if it is asked for; system, compiler
/// and viewer it is built with.
pub fn version() -> &'static str {
    static VERSION: OnceLock<String> = OnceLock::new();
    let asked = std::env::args_os().any(|a| a == "--version" || a == "-V");
    match asked {
        true => VERSION.get_or_init(|| {
            let viewer = match cfg!(feature = "viewer") {
                true => "with the viewer (Rerun 0.36.3)",
                false => "without the viewer",
            };
            format!("{}\n{}, {viewer}", identity(), env!("MONORIG_BUILD"))
        }),
        false => env!("CARGO_PKG_VERSION"),
    }
}

/// The same command line with the names of the estimators there are in its help.
pub fn with_names(command: clap::Command, registry: &Registry) -> clap::Command {
    let names: Vec<&str> = registry.estimators().iter().map(|t| t.name()).collect();
    command.mut_subcommand("compare", |compare| {
        compare.mut_arg("estimators", |argument| {
            let long = format!("{}\n\nTypes: {}", compare::ESTIMATORS, names.join(", "));
            argument.long_help(long)
        })
    })
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Simulate a scenario: train, sensors, estimators and controller in closed loop
    Run(run::RunArgs),
    /// Run scenarios over their seeds and judge what they expect
    Test(test::TestArgs),
    /// Run estimators side by side over the seeds of a scenario and compare their metrics
    Compare(compare::CompareArgs),
    /// How near the estimators of a scenario come to the Cramér-Rao bound
    Bound(bound::BoundArgs),
    /// Run a scenario many times with drawn values (Monte Carlo); a study that was stopped goes on
    Study(study::StudyArgs),
    /// Put the shards of a study together
    Merge(merge::MergeArgs),
    /// Search for the parameters of an estimator that are best over many runs
    Tune(tune::TuneArgs),
    /// Write a report as one HTML file
    Report(report::ReportArgs),
    /// Which source of error makes how much of a run's errors
    Explain(explain::ExplainArgs),
    /// Draw scenarios at random: courses that no estimator was tuned on
    Draw(draw::DrawArgs),
    /// Write the profile of the rail that a run or a recorded log went over, as a track file
    Map(map::MapArgs),
    /// Figures of real instruments from their recordings
    Sensors(sensors::SensorsArgs),
    /// List the runs in the folder for results, with what tells variants apart
    Runs(runs::RunsArgs),
    /// List estimators, parameters, metrics, channels, faults, sensors or scenarios
    List(list::ListArgs),
    /// Run estimators over a recorded log, mapped by a map file
    Replay(replay::ReplayArgs),
    /// Write a run as a recorded log, with the map that replays it
    Export(export::ExportArgs),
    /// Judge estimates made elsewhere beside ours, over a run or a log
    Judge(judge::JudgeArgs),
    /// Find parameters of vehicle and instruments from a log whose mass and slope are known
    Calibrate(calibrate::CalibrateArgs),
    /// Show what is in a recorded log, and propose a map file for it
    Inspect(inspect::InspectArgs),
    /// Check files without running anything
    Check(check::CheckArgs),
    /// Print the JSON Schema of a file format: every key, its meaning and its unit
    Schema(schema::SchemaArgs),
    /// Print a script that completes commands and options in a shell
    Completions(completions::CompletionsArgs),
    /// Write man pages
    Man(completions::ManArgs),
}

impl Command {
    /// Do it.
    pub fn run(&self, registry: &Registry) -> Result<CommandOutcome, CliError> {
        match self {
            Self::Run(args) => run::run(args, registry),
            Self::Test(args) => test::test(args, registry),
            Self::Compare(args) => compare::compare(args, registry),
            Self::Bound(args) => bound::bound(args, registry),
            Self::Study(args) => study::study(args, registry),
            Self::Merge(args) => merge::merge(args),
            Self::Tune(args) => tune::tune(args, registry),
            Self::Report(args) => report::report(args),
            Self::Explain(args) => explain::explain(args, registry),
            Self::Draw(args) => draw::draw(args, registry),
            Self::Map(args) => map::map(args),
            Self::Sensors(args) => sensors::sensors(args),
            Self::Runs(args) => runs::runs(args),
            Self::List(args) => list::list(args, registry),
            Self::Replay(args) => replay::replay(args, registry),
            Self::Export(args) => export::export(args),
            Self::Judge(args) => judge::judge(args, registry),
            Self::Calibrate(args) => calibrate::calibrate(args),
            Self::Inspect(args) => inspect::run(args),
            Self::Check(args) => check::check(args, registry),
            Self::Completions(args) => completions::completions(args, registry),
            Self::Man(args) => completions::man(args, registry),
            Self::Schema(args) => schema::schema(args, registry),
        }
    }
}
