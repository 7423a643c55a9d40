//! `monorig sensors`: figures of real instruments.

use crate::command::{Command, CommandOutcome, Program};
use crate::ui::errors::CliError;
use crate::ui::note::note;
use crate::ui::{output, tables};
use monorig_lab::recordings::columns::{self, Selection, Wanted};
use monorig_lab::recordings::page::{FIGURES, figures, page};
use monorig_lab::recordings::{ColumnFit, fit};
use std::path::PathBuf;

const FIT_EXAMPLES: &str = "\
Examples:
  monorig sensors fit standstill.csv
      every column that holds numbers, over the column t or time
  monorig sensors fit drive.csv --columns wy=deg/s,ax=g
      two columns, in degrees per second and in g
  monorig sensors fit drive.csv --from-s 12 --to-s 40
      a stretch of it, such as a standstill
  monorig sensors fit runs.csv --pieces run --out runs.html
      pieces of several runs: bias from run to run

Units: m/s2, g, mg, rad/s, deg/s, m/s, km/h, rad, deg, Nm, MPa; results are in
SI units. The file has the names of its columns in the first line. White noise,
bias instability and random walk are those of IEEE Std 952-1997, annex C, fitted
to the overlapping Allan deviation.";

/// Show the figures of real instruments from their recordings.
#[derive(Debug, clap::Parser)]
#[command(name = "sensors")]
pub struct SensorsArgs {
    /// Task
    #[command(subcommand)]
    pub command: SensorsCommand,
}

/// Tasks for recordings of instruments.
#[derive(Debug, clap::Subcommand)]
pub enum SensorsCommand {
    /// Fit noise density, bias instability, random walk and vibration to a recording, in the keys of a sensor sheet
    Fit(FitArgs),
}

/// `monorig sensors fit`
#[derive(Debug, clap::Args)]
#[command(after_help = FIT_EXAMPLES)]
pub struct FitArgs {
    /// CSV file with the names of its columns in the first line
    pub file: PathBuf,
    /// Column of the time, s; without it `t`, `time`, `t_s` or `time_s`
    #[arg(long, value_name = "COLUMN")]
    pub time: Option<String>,
    /// Columns to be fitted, each with its unit if that is no SI unit; without it all but the time
    #[arg(long, value_name = "NAME[=UNIT],…", value_delimiter = ',', value_parser = Wanted::parse)]
    pub columns: Vec<Wanted>,
    /// Column whose change begins a new piece, such as the number of a run
    #[arg(long, value_name = "COLUMN")]
    pub pieces: Option<String>,
    /// Time from which on samples count, s
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    pub from_s: Option<f64>,
    /// Time until which samples count, s
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    pub to_s: Option<f64>,
    /// Write the report here instead of beside the recording
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

impl Command for SensorsArgs {
    fn run(&self, _: &Program<'_>) -> Result<CommandOutcome, CliError> {
        sensors(self)
    }
}

/// Do it.
fn sensors(task: &SensorsArgs) -> Result<CommandOutcome, CliError> {
    match &task.command {
        SensorsCommand::Fit(args) => fit_file(args),
    }
}

fn fit_file(task: &FitArgs) -> Result<CommandOutcome, CliError> {
    let selection = Selection {
        time: task.time.clone(),
        columns: task.columns.clone(),
        pieces: task.pieces.clone(),
        from_s: task.from_s,
        to_s: task.to_s,
    };
    let recording = columns::read(&task.file, &selection)?;
    let fits = fit(&recording);
    let name = task.file.file_stem().unwrap_or_default().to_string_lossy();
    let out = task
        .out
        .clone()
        .unwrap_or_else(|| task.file.with_extension("html"));
    output::write(&out, &page(&name, &fits).to_html())?;
    output::print(&text(&fits))?;
    note(&format!("report in {}", out.display()));
    Ok(CommandOutcome::Held)
}

/// The table, a row a column, and the keys of a sheet.
fn text(fits: &[ColumnFit]) -> String {
    let titles = ["column"].into_iter().chain(FIGURES);
    let mut table = tables::table(titles);
    tables::right(&mut table, 2..=FIGURES.len());
    for fit in fits {
        table.add_row([fit.name.clone()].into_iter().chain(figures(fit)));
    }
    let mut out = tables::lines(&table) + "\n";
    for fit in fits {
        let keys = fit.sheet_keys().replace('\n', ", ");
        out += &format!("\n{}: errors: {{{keys}}}", fit.name);
    }
    out + "\n"
}
