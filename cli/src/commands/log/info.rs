//! `monorig log info`: show the content of a recorded log.

use crate::command::CommandOutcome;
use crate::files::folders::entries;
use crate::ui::errors::CliError;
use crate::ui::note::note;
use crate::ui::{output, tables};
use monorig_logs::check::{
    InspectedFile, Inspection, TableReport, inspect, proposed_map, with_axes,
};
use monorig_logs::read::{ReadOptions, TimeUnit};
use monorig_sim::config::file::input_error;
use monorig_sim::error::Error;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

const INFO_EXAMPLES: &str = "\
Examples:
  monorig log info drive.mf4
      channel groups, rates, jitter, gaps, ranges, and a map to begin with
  monorig log info drive/
      all logs of a folder, and one map for them
  monorig log info bus.log --dbc crane.dbc
      a CAN log needs the database of its messages
  monorig log info table.csv --time Zeit --unit ms
      a table whose column of time has another name

Formats: CSV, Parquet, MAT of MATLAB, MCAP (JSON; ROS 2: Imu, JointState,
Float64, Odometry, TwistStamped), MDF 4.10 and 4.20, candump; ASC and BLF in a
program built with the feature `blf`.";

/// Show the content of a recorded log, and propose a map file.
#[derive(Debug, clap::Args)]
#[command(after_help = INFO_EXAMPLES)]
pub struct InfoArgs {
    /// The log, or a folder with the files of one log: monorig proposes one map for all files
    pub log: PathBuf,
    /// Column of the time (CSV, Parquet), if its name does not show it
    #[arg(long, value_name = "COLUMN")]
    pub time: Option<String>,
    /// Unit of that column: s, ms, us, ns, iso8601
    #[arg(long, value_name = "UNIT", value_parser = time_unit)]
    pub unit: Option<TimeUnit>,
    /// Database of the messages of a CAN log (DBC)
    #[arg(long, value_name = "FILE")]
    pub dbc: Option<PathBuf>,
}

fn time_unit(text: &str) -> Result<TimeUnit, String> {
    serde_json::from_value(text.into()).map_err(|_| "write s, ms, us, ns or iso8601".to_owned())
}

/// Show the content of the log.
pub fn run(task: &InfoArgs) -> Result<CommandOutcome, CliError> {
    let options = ReadOptions {
        time: task.time.clone(),
        unit: task.unit,
        dbc: task.dbc.clone(),
        ..ReadOptions::default()
    };
    let named = match task.log.is_dir() {
        true => logs_in(&task.log)?,
        false => vec![task.log.clone()],
    };
    let (mut paths, mut all) = (Vec::new(), Vec::new());
    for path in &named {
        match inspect(path, &options) {
            Ok(found) => {
                paths.push(path);
                all.push((name(path, Path::file_name), found));
            }
            // a logger leaves tables of other things beside its logs
            Err(Error::Input(e)) if named.len() > 1 => note(&format!("left out: {e}")),
            Err(e) => return Err(e.into()),
        }
    }
    if paths.is_empty() {
        return Err(input_error(
            &task.log,
            "",
            "no file in this folder can be read as a log",
            "name a log; the lines above say what is wrong with each file",
        )
        .into());
    }
    let one = paths.len() == 1;
    let files: Vec<InspectedFile<'_>> = paths
        .iter()
        .zip(&all)
        .map(|(path, (file, found))| match one {
            true => ("log".to_owned(), file.clone(), found),
            false => (name(path, Path::file_stem), file.clone(), found),
        })
        .collect();
    let texts: Vec<String> = all.iter().map(|(file, found)| text(found, file)).collect();
    output::print(&format!(
        "{}\nA map to begin with, guessed from the names of the columns; the axes are guessed from the values:\n\n{}",
        texts.join("\n"),
        with_axes(proposed_map(&files), &task.log)
    ))?;
    Ok(CommandOutcome::Held)
}

/// A part of a path's name as text.
fn name(path: &Path, of: fn(&Path) -> Option<&OsStr>) -> String {
    of(path).unwrap_or_default().to_string_lossy().into_owned()
}

/// File name endings of the logs in a folder.
const ENDINGS: [&str; 10] = [
    "csv", "tsv", "txt", "parquet", "mat", "mcap", "mf4", "log", "asc", "blf",
];

/// Logs in a folder, sorted by name.
fn logs_in(folder: &Path) -> Result<Vec<PathBuf>, CliError> {
    let mut all = entries(folder)?;
    all.retain(|path| {
        let ending = name(path, Path::extension).to_lowercase();
        path.is_file() && ENDINGS.contains(&ending.as_str())
    });
    match all.is_empty() {
        true => Err(input_error(
            folder,
            "",
            "this folder has no log",
            format!("the names of logs end with: {}", ENDINGS.join(", ")),
        )
        .into()),
        false => Ok(all),
    }
}

fn text(found: &Inspection, file: &str) -> String {
    let mut out = format!("{file}: {}\n", found.format);
    for table in &found.tables {
        out += &format!("\n{}\n", heading(table));
        let titles = ["column", "unit", "not a number", "min", "mean", "max"];
        let mut rows = tables::table(titles);
        tables::right(&mut rows, 2..6);
        for c in &table.columns {
            let missing = 1.0 - c.values as f64 / table.rows.max(1) as f64;
            let number = |x: f64| match c.values {
                0 => "-".to_owned(),
                _ => tables::number(x),
            };
            rows.add_row([
                c.name.clone(),
                c.unit.clone(),
                format!("{:.1} %", 100.0 * missing),
                number(c.min),
                number(c.mean),
                number(c.max),
            ]);
        }
        out += &tables::lines(&rows);
        out += "\n";
    }
    for (what, times) in &found.unread {
        out += &format!("not read: {what}, {times} times\n");
    }
    out
}

/// The table's name, length and times in a line.
fn heading(t: &TableReport) -> String {
    let name = match t.name.as_str() {
        "" => String::new(),
        name => format!("{name}: "),
    };
    let seconds = t.to_ns.saturating_sub(t.from_ns) as f64 * 1e-9;
    let mut line = format!("{name}{} rows over {seconds:.3} s", t.rows);
    if t.step_ns > 0 {
        let (rate, jitter) = (tables::number(t.rate_hz()), t.jitter_ns * 1e-6);
        line += &format!(", {rate} Hz, jitter {jitter:.3} ms, {} gaps", t.gaps);
    }
    if t.backwards > 0 {
        line += &format!(", {} times backwards", t.backwards);
    }
    line
}
