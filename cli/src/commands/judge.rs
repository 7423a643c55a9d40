//! `monorig judge`: estimates made elsewhere, judged beside ours.

use crate::command::{Command, CommandOutcome, Program};
use crate::files::load::say_left_out;
use crate::files::out::prepare_out;
use crate::files::scenarios::of_run;
use crate::recording::play::{PlayArgs, Playing, play};
use crate::ui::errors::CliError;
use monorig_logs::export::{ExportFormat, export};
use monorig_logs::map::Map;
use monorig_logs::replay::{EstimatesFile, ReplayOptions};
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::config::file::input_error;
use monorig_sim::record::manifest::{self, Manifest};
use monorig_sim::record::whole;
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
    pub play: PlayArgs,
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
    let out = task.play.out.get();
    let playing = Playing {
        options: &options,
        args: &task.play,
        full_rate: false,
    };
    let judged = |map: &mut Map| {
        let allowed = task.play.registry(map, registry);
        say_left_out(&map.leave_out_foreign(&allowed));
        play(map, &playing, registry)
    };
    if let Some(map) = &task.map {
        let mut map = Map::load_with(map, task.what.as_deref(), &task.play.sets)?;
        return judged(&mut map);
    }
    let what = task.what.clone().unwrap_or_default();
    let run = what.join(manifest::NAME);
    if !run.is_file() {
        let help = "a run of `monorig run --keep-samples`, or a log with --map";
        return Err(input_error(&what, "", "this is no folder of a run", help).into());
    }
    let manifest = Manifest::of_run(&what)?;
    prepare_out(&out)?;
    let folder = Temporary(out.join(format!(".judge-{}", whole::unique())));
    let log = export(
        &what,
        ExportFormat::PARQUET,
        &folder.0,
        of_run(&manifest).as_deref(),
    )?;
    let mut map = Map::load_with(&log.map, None, &task.play.sets)?;
    map.name = format!("{}_{}_{}", manifest.scenario, manifest.seed, task.name);
    judged(&mut map)
}

/// A folder that goes when it is no longer needed.
struct Temporary(PathBuf);

impl Drop for Temporary {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
