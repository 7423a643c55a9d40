//! `monorig replay`: run estimators over a recorded log or the kept samples of a run, and judge estimates of other
//! programs.

use super::log::check;
use crate::command::{Command, CommandOutcome, Program};
use crate::files::load::say_left_out;
use crate::files::out::prepare_out;
use crate::files::scenarios::of_run;
use crate::recording::play::{PlayArgs, Playing, play};
use crate::recording::standing_noise;
use crate::ui::errors::CliError;
use monorig_logs::drive::Found;
use monorig_logs::export::{ExportFormat, export};
use monorig_logs::map::{Map, NoiseSource};
use monorig_logs::replay::{EstimatesFile, ReplayOptions};
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::config::file::input_error;
use monorig_sim::record::manifest::{self, Manifest};
use monorig_sim::record::whole;
use std::path::{Path, PathBuf};

const REPLAY_EXAMPLES: &str = "\
Examples:
  monorig replay --map drive.map.yaml
      the files and the estimators that the map names
  monorig replay drive.mf4 --map crane.map.yaml \\
      --estimators rail_fusion,dffrls_aekf_robust
  monorig replay --map drive.map.yaml --junit replay.xml
  monorig replay runs/minimal/1 --estimates mine.csv
      estimates of another program, judged beside ours, over a run made with
      --keep-samples; with --map over a log

Results are those of `monorig run`: OUT/<map>/1/ with manifest.json,
channels.parquet, metrics.json and, with the viewer built in, run.rrd; `monorig
report` makes a page of them. `monorig log info LOG` proposes a map, `monorig
check --schema map` prints every key. The table of estimates has a time (of the
run or of the log's clock) and at least one of mass_kg, slope_deg,
effective_slope_deg, speed_mps; beside each …_sd_… (mass_sd_kg, slope_sd_deg),
…_protection_… (mass_protection_kg) and …_valid (0 or 1) are optional.";

/// Run estimators over a recorded log, or judge estimates of another program.
#[derive(Debug, clap::Parser)]
#[command(name = "replay", after_help = REPLAY_EXAMPLES)]
pub struct ReplayArgs {
    /// The log: one file, or the folder with the files of the map; without LOG the paths in the map. Without --map the
    /// folder of a run made with --keep-samples
    #[arg(value_name = "LOG|RUN", required_unless_present = "map")]
    pub log: Option<PathBuf>,
    /// Map file: the quantities in the columns of the log
    #[arg(long, value_name = "MAP")]
    pub map: Option<PathBuf>,
    /// Table of estimates of another program: CSV, Parquet or any format of a log
    #[arg(long, value_name = "FILE")]
    pub estimates: Option<PathBuf>,
    /// Name for the estimates of --estimates
    #[arg(
        long,
        hide_short_help = true,
        value_name = "NAME",
        default_value = "judged",
        requires = "estimates"
    )]
    pub name: String,
    /// Estimators to run instead of those of the map, by name
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub estimators: Vec<String>,
    /// Source of the noise for estimators: `from-log` (`wheel_speed_sd_mps` and `accel_sd_mps2` if the map does not set
    /// them, with Allan figures at standstill) or `defaults`
    #[arg(long, hide_short_help = true, value_name = "SOURCE", value_parser = noise_source)]
    pub noise: Option<NoiseSource>,
    /// Only find faults in the log, as `monorig log check` does
    #[arg(long, hide = true, requires = "map", conflicts_with_all = ["live", "no_rerun", "junit", "full_rate"])]
    pub check: bool,
    /// Draw the lines of run.rrd through every row instead of about ten a second, and record long logs at the full rate
    /// too
    #[arg(long, hide_short_help = true)]
    pub full_rate: bool,
    #[command(flatten)]
    pub play: PlayArgs,
}

/// Reads the source of the noise, in the words of the map file.
fn noise_source(word: &str) -> Result<NoiseSource, String> {
    match word {
        "from-log" => Ok(NoiseSource::FromLog),
        "defaults" => Ok(NoiseSource::Defaults),
        _ => Err("write from-log or defaults".to_owned()),
    }
}

impl Command for ReplayArgs {
    fn run(&self, program: &Program<'_>) -> Result<CommandOutcome, CliError> {
        replay(self, program.registry)
    }
}

/// Plays the log to the estimators, and judges them.
fn replay(task: &ReplayArgs, registry: &Registry) -> Result<CommandOutcome, CliError> {
    let (mut map, _kept) = match (&task.map, &task.log) {
        (Some(map), log) => (Map::load_with(map, log.as_deref(), &task.play.sets)?, None),
        (None, run) => {
            let (map, kept) = map_of_run(run.as_deref().unwrap_or(Path::new("")), task)?;
            (map, Some(kept))
        }
    };
    if task.check {
        return check::check(&map);
    }
    if task.map.is_none() || task.estimates.is_some() {
        let allowed = task.play.registry(&map, registry);
        say_left_out(&map.leave_out_foreign(&allowed));
    }
    let noise = task.noise.or(map.noise());
    let found = match noise == Some(NoiseSource::FromLog) {
        true => standing_noise::figures(&map)?,
        false => Vec::new(),
    };
    let found = found.into_iter().map(|p| Found {
        what: p.name,
        value: p.value,
        sd: p.sd,
        unit: p.unit,
    });
    let judged = task.estimates.as_ref().map(|file| {
        let table = EstimatesFile::load(file)?;
        Ok::<_, CliError>((task.name.clone(), table))
    });
    let options = ReplayOptions {
        estimators: task.estimators.clone(),
        noise,
        found: found.collect(),
        judged: judged.into_iter().collect::<Result<_, _>>()?,
    };
    let playing = Playing {
        options: &options,
        args: &task.play,
        full_rate: task.full_rate,
    };
    play(&map, &playing, registry)
}

/// Map of a run that has kept its samples, and the folder of its log.
fn map_of_run(run: &Path, task: &ReplayArgs) -> Result<(Map, Temporary), CliError> {
    if !run.join(manifest::NAME).is_file() {
        let help = "use a run of `monorig run --keep-samples`, or a log with --map";
        return Err(input_error(run, "", "this is not the folder of a run", help).into());
    }
    let manifest = Manifest::of_run(run)?;
    let out = task.play.out.get();
    prepare_out(&out)?;
    let folder = Temporary(out.join(format!(".replay-{}", whole::unique())));
    let scenario = of_run(&manifest);
    let log = export(run, ExportFormat::PARQUET, &folder.0, scenario.as_deref())?;
    let mut map = Map::load_with(&log.map, None, &task.play.sets)?;
    let name = task.estimates.as_ref().map_or("replay", |_| &task.name);
    map.name = format!("{}_{}_{name}", manifest.scenario, manifest.seed);
    Ok((map, folder))
}

/// Temporary folder, removed when the value is dropped.
struct Temporary(PathBuf);

impl Drop for Temporary {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
