//! `monorig replay`: estimators over a recorded log.

use crate::CommandOutcome;
use crate::commands::run::{VIEWER, address, prepare_out};
use crate::commands::shared::{Out, assignment};
use crate::commands::standing_noise;
use crate::commands::test::{TestedScenario, junit};
use crate::simulate::{RecordOptions, simulate};
use crate::ui::errors::CliError;
use crate::ui::interrupt;
use crate::ui::note::note;
use crate::ui::progress::ProgressDisplay;
use crate::ui::prose::paragraph;
use crate::ui::{output, summary, tables};
use crate::variant::Variant;
use monorig_lab::batch::RunResult;
use monorig_lab::verdicts::expected;
use monorig_lab::verdicts::verdict::ScenarioVerdict;
use monorig_logs::check::{Verdict, check};
use monorig_logs::drive::Found;
use monorig_logs::map::{Map, NoiseSource};
use monorig_logs::replay::{ReplayOptions, build};
use monorig_sim::closed_loop::registry::Registry;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::time::Duration;

const REPLAY_EXAMPLES: &str = "\
Examples:
  monorig replay --map drive.map.yaml
      the files and the estimators that the map names
  monorig replay drive.mf4 --map crane.map.yaml \\
      --estimators rail_fusion,dffrls_aekf_robust
  monorig replay --map drive.map.yaml --check
      what is wrong with this log, before anything runs
  monorig replay --map drive.map.yaml --junit out/replay.xml
  monorig replay --map drive.map.yaml --ghost
      beside the vehicle of the map on the same drive

Results are those of `monorig run`: OUT/<map>/1/ with manifest.json,
channels.parquet, metrics.json and, with the viewer built in, run.rrd; `monorig
report` makes a page of them. `monorig inspect LOG` proposes a map, `monorig
schema map` prints every key.";

/// `monorig replay`
#[derive(Debug, clap::Args)]
#[command(after_help = REPLAY_EXAMPLES)]
pub struct ReplayArgs {
    /// The log: one file, or the folder in which the files of the map are; without it where the map says
    pub log: Option<PathBuf>,
    /// What the columns of the log measure
    #[arg(long, value_name = "MAP")]
    pub map: PathBuf,
    /// Estimators to run instead of those of the map, by name
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    pub estimators: Vec<String>,
    /// Give estimators the noise of the log: `wheel_speed_sd_mps` and `accel_sd_mps2` where the map does not set them
    #[arg(long, value_name = "SOURCE", value_parser = noise_source)]
    pub noise: Option<NoiseSource>,
    /// Also record the vehicle of the map on the same drive, with the speed that was measured: the traction, motor torque and specific force
    /// that it has, and how far off the measured ones are
    #[arg(long)]
    pub ghost: bool,
    /// Only say what is wrong with the log: each check with a number and a verdict
    #[arg(long, conflicts_with_all = ["live", "no_rerun", "junit", "full_rate", "ghost"])]
    pub check: bool,
    #[command(flatten)]
    pub out: Out,
    /// Also stream to a Rerun viewer; without an address to the one that is open on this machine
    #[arg(long, value_name = "HOST:PORT", conflicts_with = "no_rerun", num_args = 0..=1, require_equals = true,
        default_missing_value = VIEWER, value_parser = address)]
    pub live: Option<SocketAddr>,
    /// Do not write run.rrd
    #[arg(long)]
    pub no_rerun: bool,
    /// Draw the lines of run.rrd through every row instead of about ten a second, and record long logs at the full rate too
    #[arg(long)]
    pub full_rate: bool,
    /// Write the verdicts as JUnit XML, as CI servers read it
    #[arg(long, value_name = "FILE")]
    pub junit: Option<PathBuf>,
    /// Change a value of the map; may be given several times
    #[arg(long = "set", value_name = "PATH=VALUE", value_parser = assignment)]
    pub sets: Vec<(String, String)>,
}

/// Where the noise is from, in the words of the map file.
fn noise_source(word: &str) -> Result<NoiseSource, String> {
    match word {
        "from-log" => Ok(NoiseSource::FromLog),
        _ => Err("write from-log".to_owned()),
    }
}

/// Play the log to the estimators, and judge them.
pub fn replay(task: &ReplayArgs, registry: &Registry) -> Result<CommandOutcome, CliError> {
    let map = Map::load_with(&task.map, task.log.as_deref(), &task.sets)?;
    if task.check {
        return check_log(&map);
    }
    let noise_from_log = task.noise.or(map.noise()).is_some();
    let found = match noise_from_log {
        true => standing_noise::figures(&map)?,
        false => Vec::new(),
    };
    let found = found.into_iter().map(|p| Found {
        what: p.name,
        value: p.value,
        sd: p.sd,
        unit: p.unit,
    });
    let options = ReplayOptions {
        estimators: task.estimators.clone(),
        noise_from_log,
        ghost: task.ghost,
        found: found.collect(),
        ..ReplayOptions::default()
    };
    let playing = Playing {
        options: &options,
        out: &task.out.get(),
        live: task.live,
        no_rerun: task.no_rerun,
        full_rate: task.full_rate,
        junit: task.junit.as_deref(),
        sets: &task.sets,
    };
    play(&map, &playing, registry)
}

/// How a log is played.
pub struct Playing<'a> {
    /// What is run over it.
    pub options: &'a ReplayOptions,
    /// Folder of the results.
    pub out: &'a Path,
    /// Also stream to the viewer at this address.
    pub live: Option<SocketAddr>,
    /// Do not write `run.rrd`.
    pub no_rerun: bool,
    /// Record long logs at the full rate too.
    pub full_rate: bool,
    /// Write the verdicts as JUnit XML here.
    pub junit: Option<&'a Path>,
    /// What was changed in the map.
    pub sets: &'a [(String, String)],
}

/// Play a log, judge the estimators, and show the verdicts.
pub fn play(
    map: &Map,
    task: &Playing<'_>,
    registry: &Registry,
) -> Result<CommandOutcome, CliError> {
    if let Some(path) = task.junit {
        output::clear(path)?;
    }
    let out = task.out;
    let (mut simulation, found) = build(map, task.options, registry)?;
    expected::check(&simulation.scenario)?;
    let variant = Variant::new(task.sets, None);
    simulation.scenario.name = variant.run_name(&simulation.scenario.name);
    prepare_out(out)?;
    for f in &found {
        note(&format!(
            "found: {} = {} ± {} {}",
            f.what,
            tables::number(f.value),
            tables::number(f.sd),
            f.unit
        ));
    }
    interrupt::listen();
    let mut progress = ProgressDisplay::new(&format!("replay of {}", map.name));
    let options = RecordOptions {
        out,
        live: task.live,
        pace: None,
        no_rerun: task.no_rerun,
        full_rate: task.full_rate,
        keep_samples: false,
        changes: &variant.changes,
        registry,
    };
    let run = simulate(simulation, &options, &mut |share| {
        progress.at(share);
        interrupt::go_on()
    })?;
    drop(progress);
    note(&format!("results in {}", run.folder.display()));
    output::verdicts(&summary::text(&run.summary, run.wall_s))?;
    if run.interrupted {
        return Err(CliError::Interrupted);
    }
    let good = run.summary.good();
    if let Some(path) = task.junit {
        let result = RunResult {
            index: 0,
            scenario: map.name.clone(),
            seed: run.summary.seed,
            draws: Default::default(),
            summary: Some(run.summary),
            error: None,
        };
        let tested = TestedScenario {
            judged: ScenarioVerdict::new(&map.name, vec![result]),
            unusable: None,
            took: Duration::from_secs_f64(run.wall_s),
        };
        output::write(path, &junit::xml(&[tested])?)?;
    }
    Ok(match good {
        true => CommandOutcome::Held,
        false => CommandOutcome::Failed,
    })
}

/// The checks of a log, each with what was found and what would be good.
fn check_log(map: &Map) -> Result<CommandOutcome, CliError> {
    let (mut text, mut bad) = (String::new(), 0);
    for c in check(map)? {
        let (word, why) = match &c.verdict {
            Verdict::Good => ("good", String::new()),
            Verdict::Bad(why) => ("BAD", why.clone()),
            Verdict::Unknown(why) => ("?", why.clone()),
        };
        bad += usize::from(word == "BAD");
        let value = match c.value.is_nan() {
            true => "-".to_owned(),
            false => format!("{} {}", tables::number(c.value), c.unit),
        };
        let told = format!(
            "{word:<4}  {}: {} (good: {})",
            c.what,
            value.trim_end(),
            c.good
        );
        text += &format!("{}\n", paragraph(&told, ""));
        if !why.is_empty() {
            text += &format!("{}\n", paragraph(&why, "      "));
        }
    }
    let end = match bad {
        0 => "nothing wrong was found".to_owned(),
        n => format!("{n} checks say that something is wrong"),
    };
    output::print(&format!("{text}\n{end}\n"))?;
    Ok(match bad {
        0 => CommandOutcome::Held,
        _ => CommandOutcome::Failed,
    })
}
