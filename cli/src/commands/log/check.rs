//! `monorig log check`: find faults in a recorded log.

use crate::arguments::assignment;
use crate::command::CommandOutcome;
use crate::ui::errors::CliError;
use crate::ui::prose::paragraph;
use crate::ui::{output, tables};
use monorig_logs::check::{ChannelReport, Verdict, report};
use monorig_logs::map::Map;
use std::path::PathBuf;

/// Find faults in a log before a replay: each check has a number and a verdict.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  monorig log check --map drive.map.yaml\n  monorig log check drive.mf4 --map crane.map.yaml"
)]
pub struct CheckLogArgs {
    /// The log: one file, or the folder with the files of the map; without LOG the paths in the map
    pub log: Option<PathBuf>,
    /// Map file: the quantities in the columns of the log
    #[arg(long, value_name = "MAP")]
    pub map: PathBuf,
    /// Change a value of the map; may be given several times
    #[arg(long = "set", value_name = "PATH=VALUE", value_parser = assignment)]
    pub sets: Vec<(String, String)>,
}

/// Loads the map and checks the log.
pub fn run(task: &CheckLogArgs) -> Result<CommandOutcome, CliError> {
    check(&Map::load_with(&task.map, task.log.as_deref(), &task.sets)?)
}

/// Prints the checks of a log, each with the value found and the good value.
pub fn check(map: &Map) -> Result<CommandOutcome, CliError> {
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
    if map.is_trimmed() {
        text += "?     a part of the log only: `trim` of the map leaves the rest out\n";
        unknown += 1;
    }
    let end = match (bad, unknown) {
        (0, 0) => "held: nothing wrong was found".to_owned(),
        (0, n) => {
            format!("held but for {n} not judged: the other {good} found nothing wrong")
        }
        (n, _) => format!("FAILED: {n} checks found something wrong"),
    };
    output::verdicts(&format!("{text}\n{}\n\n{end}\n", of_channels(&channels)))?;
    Ok(CommandOutcome::of(bad == 0))
}

/// Rate, jitter, gaps, repeated stamps and usable share of each channel.
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
