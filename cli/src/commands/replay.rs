//! `monorig replay`: estimators over a recorded log.

use crate::command::{Command, CommandOutcome, Program};
use crate::recording::play::{PlayArgs, Playing, play};
use crate::recording::standing_noise;
use crate::ui::errors::CliError;
use crate::ui::prose::paragraph;
use crate::ui::{output, tables};
use monorig_logs::check::{ChannelReport, Verdict, report};
use monorig_logs::drive::Found;
use monorig_logs::map::{Map, NoiseSource};
use monorig_logs::replay::ReplayOptions;
use monorig_sim::closed_loop::registry::Registry;
use std::path::PathBuf;

const REPLAY_EXAMPLES: &str = "\
Examples:
  monorig replay --map drive.map.yaml
      the files and the estimators that the map names
  monorig replay drive.mf4 --map crane.map.yaml \\
      --estimators rail_fusion,dffrls_aekf_robust
  monorig replay --map drive.map.yaml --check
      what is wrong with this log, before anything runs
  monorig replay --map drive.map.yaml --junit replay.xml
  monorig replay --map drive.map.yaml --ghost
      beside the vehicle of the map on the same drive

Results are those of `monorig run`: OUT/<map>/1/ with manifest.json,
channels.parquet, metrics.json and, with the viewer built in, run.rrd; `monorig
report` makes a page of them. `monorig inspect LOG` proposes a map, `monorig
schema map` prints every key.";

/// Run estimators over a recorded log, mapped by a map file.
#[derive(Debug, clap::Parser)]
#[command(name = "replay", after_help = REPLAY_EXAMPLES)]
pub struct ReplayArgs {
    /// The log: one file, or the folder in which the files of the map are; without it where the map says
    pub log: Option<PathBuf>,
    /// Map file: the quantities in the columns of the log
    #[arg(long, value_name = "MAP")]
    pub map: PathBuf,
    /// Estimators to run instead of those of the map, by name
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    pub estimators: Vec<String>,
    /// Where estimators have the noise from: `from-log` (`wheel_speed_sd_mps` and `accel_sd_mps2` where the map does
    /// not set them, with Allan figures of what stands) or `defaults`
    #[arg(long, value_name = "SOURCE", value_parser = noise_source)]
    pub noise: Option<NoiseSource>,
    /// Also record the vehicle of the map on the same drive, with the speed that was measured: the traction, motor
    /// torque and specific force that it has, and how far off the measured ones are
    #[arg(long)]
    pub ghost: bool,
    /// Only say what is wrong with the log: each check with a number and a verdict
    #[arg(long, conflicts_with_all = ["live", "no_rerun", "junit", "full_rate", "ghost"])]
    pub check: bool,
    /// Draw the lines of run.rrd through every row instead of about ten a second, and record long logs at the full rate
    /// too
    #[arg(long)]
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

/// Play the log to the estimators, and judge them.
fn replay(task: &ReplayArgs, registry: &Registry) -> Result<CommandOutcome, CliError> {
    let map = Map::load_with(&task.map, task.log.as_deref(), &task.play.sets)?;
    if task.check {
        return check_log(&map);
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
    let options = ReplayOptions {
        estimators: task.estimators.clone(),
        noise,
        ghost: task.ghost,
        found: found.collect(),
        ..ReplayOptions::default()
    };
    let playing = Playing {
        options: &options,
        args: &task.play,
        full_rate: task.full_rate,
    };
    play(&map, &playing, registry)
}

/// The checks of a log, each with what was found and what would be good.
fn check_log(map: &Map) -> Result<CommandOutcome, CliError> {
    let (mut text, mut good, mut bad, mut unknown) = (String::new(), 0, 0, 0);
    let (checks, channels) = report(map)?;
    for c in checks {
        let (word, why) = match &c.verdict {
            Verdict::Good => ("good", String::new()),
            Verdict::Bad(why) => ("BAD", why.clone()),
            Verdict::Unknown(why) => ("?", why.clone()),
        };
        good += usize::from(word == "good");
        bad += usize::from(word == "BAD");
        unknown += usize::from(word == "?");
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
    let end = match (bad, unknown) {
        (0, 0) => "held: nothing wrong was found".to_owned(),
        (0, n) => {
            format!("held but for {n} not judged: nothing wrong was found in the other {good}")
        }
        (n, _) => format!("FAILED: {n} checks say that something is wrong"),
    };
    output::verdicts(&format!("{text}\n{}\n\n{end}\n", of_channels(&channels)))?;
    Ok(CommandOutcome::of(bad == 0))
}

/// Rate, jitter, gaps, stamps that come twice and share that counts of each channel.
fn of_channels(channels: &[ChannelReport]) -> String {
    let titles = [
        "channel",
        "Hz",
        "jitter ms",
        "gaps",
        "longest s",
        "twice",
        "valid %",
    ];
    let mut table = tables::table(titles);
    for c in channels {
        table.add_row([
            c.name.clone(),
            tables::number(c.rate_hz),
            tables::number(c.jitter_ms),
            c.gaps.to_string(),
            tables::number(c.longest_gap_s),
            c.duplicates.to_string(),
            tables::number(100.0 * c.valid),
        ]);
    }
    tables::right(&mut table, 1..titles.len());
    tables::lines(&table)
}
