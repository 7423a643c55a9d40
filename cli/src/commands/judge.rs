//! `monorig judge`: estimates made elsewhere, judged beside ours.

use crate::arguments::{Json, Out, VIEWER, address, assignment};
use crate::command::{Command, CommandOutcome, Program};
use crate::files::out::prepare_out;
use crate::recording::play::{Playing, play};
use crate::ui::errors::CliError;
use monorig_logs::export::{ExportFormat, export};
use monorig_logs::map::Map;
use monorig_logs::replay::{EstimatesFile, ReplayOptions};
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::error::{Error, InputError};
use monorig_sim::record::manifest::{self, Manifest};
use monorig_sim::record::whole;
use std::net::SocketAddr;
use std::path::PathBuf;

const JUDGE_EXAMPLES: &str = "\
Examples:
  monorig judge runs/minimal/1 --estimates mine.csv
      a run that has kept its samples (`monorig run --keep-samples`)
  monorig judge --map crane.map.yaml --estimates mine.csv
      over the log that the map names
  monorig judge drive.mf4 --map crane.map.yaml --estimates mine.parquet \\
      --name filter_7

The table has a time and at least one of mass_kg, slope_deg,
effective_slope_deg, speed_mps; beside each …_sd_… (mass_sd_kg, slope_sd_deg)
and …_valid (0 or 1) if there are. Times are those of the run or of the log's
clock. Results are those of `monorig replay`.";

/// Judge estimates made elsewhere beside ours, over a run or a log.
#[derive(Debug, clap::Parser)]
#[command(name = "judge", after_help = JUDGE_EXAMPLES)]
pub struct JudgeArgs {
    /// Folder of a run that has kept its samples, or a log; with --map without it where the map says
    #[arg(value_name = "RUN|LOG", required_unless_present = "map")]
    pub what: Option<PathBuf>,
    /// Map file: the quantities in the columns of a log; not of a run
    #[arg(long, value_name = "MAP")]
    pub map: Option<PathBuf>,
    /// Table of the estimates: CSV, Parquet or any format of a log
    #[arg(long, value_name = "FILE")]
    pub estimates: PathBuf,
    /// Name under which they are judged
    #[arg(long, value_name = "NAME", default_value = "judged")]
    pub name: String,
    #[command(flatten)]
    pub out: Out,
    /// Also stream to a Rerun viewer; without an address to the one that is open on this machine
    #[arg(long, value_name = "HOST:PORT", conflicts_with = "no_rerun", num_args = 0..=1, require_equals = true,
        default_missing_value = VIEWER, value_parser = address)]
    pub live: Option<SocketAddr>,
    /// Do not write run.rrd
    #[arg(long)]
    pub no_rerun: bool,
    /// Write the verdicts as JUnit XML, as CI servers read it
    #[arg(long, value_name = "FILE")]
    pub junit: Option<PathBuf>,
    /// Change a value of the map, such as `expect=[…]`; may be given several times
    #[arg(long = "set", value_name = "PATH=VALUE", value_parser = assignment)]
    pub sets: Vec<(String, String)>,
    #[command(flatten)]
    pub json: Json,
}

impl Command for JudgeArgs {
    fn run(&self, program: &Program<'_>) -> Result<CommandOutcome, CliError> {
        judge(self, program.registry)
    }
}

/// Play the log with the estimates beside ours.
fn judge(task: &JudgeArgs, registry: &Registry) -> Result<CommandOutcome, CliError> {
    let file = EstimatesFile::load(&task.estimates)?;
    let options = ReplayOptions {
        judged: vec![(task.name.clone(), file)],
        ..ReplayOptions::default()
    };
    let out = task.out.get();
    let playing = Playing {
        options: &options,
        out: &out,
        live: task.live,
        no_rerun: task.no_rerun,
        full_rate: false,
        junit: task.junit.as_deref(),
        json: &task.json,
        sets: &task.sets,
    };
    if let Some(map) = &task.map {
        let map = Map::load_with(map, task.what.as_deref(), &task.sets)?;
        return play(&map, &playing, registry);
    }
    let what = task.what.clone().unwrap_or_default();
    let run = what.join(manifest::NAME);
    if !run.is_file() {
        let wrong = InputError {
            file: what,
            line: None,
            column: None,
            key: String::new(),
            message: "this is no folder of a run".into(),
            help: "a run of `monorig run --keep-samples`, or a log with --map".into(),
        };
        return Err(Error::from(wrong).into());
    }
    let manifest = Manifest::of_run(&what)?;
    prepare_out(&out)?;
    let folder = Temporary(out.join(format!(".judge-{}", whole::unique())));
    let log = export(&what, ExportFormat::PARQUET, &folder.0)?;
    let mut map = Map::load_with(&log.map, None, &task.sets)?;
    map.name = format!("{}_{}_{}", manifest.scenario, manifest.seed, task.name);
    play(&map, &playing, registry)
}

/// A folder that goes when it is no longer needed.
struct Temporary(PathBuf);

impl Drop for Temporary {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
