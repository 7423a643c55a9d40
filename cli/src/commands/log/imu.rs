//! `monorig log imu`: noise figures of real instruments.

use crate::command::CommandOutcome;
use crate::ui::errors::CliError;
use crate::ui::note::note;
use crate::ui::{output, tables};
use monorig_lab::recordings::page::{FIGURES, figures, page};
use monorig_lab::recordings::{ColumnFit, RecordedRow, Recording, fit};
use monorig_logs::read::{ReadOptions, WantedColumn, columns};
use monorig_sim::config::file::input_error;
use std::path::PathBuf;

const IMU_EXAMPLES: &str = "\
Examples:
  monorig log imu standstill.csv
      every column that holds numbers
  monorig log imu drive.csv --columns wy=deg/s,ax=g
      two columns, in degrees per second and in g
  monorig log imu drive.csv --from-s 12 --to-s 40
      a stretch of it, such as a standstill
  monorig log imu runs.csv --pieces run --out runs.html
      pieces of several runs: bias from run to run

Units: m/s2, g, mg, rad/s, deg/s, m/s, km/h, rad, deg, Nm, MPa; results are in
SI units. White noise, bias instability and random walk are those of IEEE Std
952-1997, annex C, fitted to the overlapping Allan deviation.";

/// Fit noise density, bias instability, random walk and vibration to an instrument's recording, as keys of a sensor
/// sheet.
#[derive(Debug, clap::Args)]
#[command(after_help = IMU_EXAMPLES)]
pub struct ImuArgs {
    /// The recording, in any format of a log (`monorig log info`)
    pub file: PathBuf,
    /// Column of the time (CSV, Parquet), if its name does not show it
    #[arg(long, value_name = "COLUMN")]
    pub time: Option<String>,
    /// Columns to fit, as NAME or NAME=UNIT, with commas between them; without this option all columns of numbers
    #[arg(long, value_name = "COLUMNS", value_delimiter = ',', value_parser = WantedColumn::parse)]
    pub columns: Vec<WantedColumn>,
    /// Column whose change begins a new piece, such as the number of a run
    #[arg(long, value_name = "COLUMN")]
    pub pieces: Option<String>,
    /// Use samples from this time on, s
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    pub from_s: Option<f64>,
    /// Use samples until this time, s
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    pub to_s: Option<f64>,
    /// Write the report here instead of beside the recording
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// Fits the columns, prints the table and writes the page.
pub fn run(task: &ImuArgs) -> Result<CommandOutcome, CliError> {
    let options = ReadOptions {
        time: task.time.clone(),
        pieces: task.pieces.clone(),
        ..ReadOptions::default()
    };
    let (names, rows) = columns(&task.file, &options, &task.columns)?;
    let [from_s, to_s] = [
        task.from_s.unwrap_or(f64::MIN),
        task.to_s.unwrap_or(f64::MAX),
    ];
    let rows = rows
        .into_iter()
        .map(|(run, t_s, values)| RecordedRow { run, t_s, values });
    let rows = rows.filter(|row| (from_s..=to_s).contains(&row.t_s));
    let Some(recording) = Recording::cut(names, rows.collect()) else {
        let message = "the recording has no stretch of 16 samples without a gap";
        let help = "use times that grow; --pieces NAME if the time begins anew with each run";
        return Err(input_error(&task.file, "", message, help).into());
    };
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
