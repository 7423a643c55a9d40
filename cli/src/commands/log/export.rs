//! `monorig log export`: a run as a log.

use crate::command::CommandOutcome;
use crate::files::scenarios::of_run;
use crate::ui::errors::CliError;
use crate::ui::note::note;
use crate::ui::output;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use monorig_logs::export::{ExportFormat, export};
use monorig_sim::record::manifest::Manifest;
use std::path::PathBuf;

const EXPORT_EXAMPLES: &str = "\
Examples:
  monorig run scenarios/minimal.yaml --keep-samples
      keep every sample of the run
  monorig log export runs/minimal/1 --to csv
      exports/minimal/1/csv/ with minimal_1_csv.map.yaml
  monorig log export runs/minimal/1 --to can --out bus       candump and DBC
  monorig replay --map exports/minimal/1/csv/minimal_1_csv.map.yaml
      gives the estimates of the run again

The replay of each format but can gives the run's estimates bit for bit; CAN
signals are rounded. mat has the estimates too.";

/// Write a run as a recorded log, with the map that replays it.
#[derive(Debug, clap::Args)]
#[command(after_help = EXPORT_EXAMPLES)]
pub struct ExportArgs {
    /// Folder of a run made with --keep-samples
    pub run: PathBuf,
    /// Format of the log
    #[arg(long, value_name = "FORMAT", value_parser = formats())]
    pub to: ExportFormat,
    /// New folder for the log; without this option exports/SCENARIO/SEED/FORMAT
    #[arg(long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
}

/// Formats by name.
fn formats() -> impl TypedValueParser<Value = ExportFormat> {
    let value = |f: ExportFormat| PossibleValue::new(f.name()).help(f.files());
    PossibleValuesParser::new(ExportFormat::all().map(value))
        .try_map(|name| ExportFormat::find(&name).ok_or("no format has this name"))
}

/// Write the log.
pub fn run(task: &ExportArgs) -> Result<CommandOutcome, CliError> {
    let format = task.to;
    let out = task.out.clone().unwrap_or_else(|| {
        let mut last = task
            .run
            .components()
            .rev()
            .map(|c| c.as_os_str().to_owned());
        let seed = last.next().unwrap_or_default();
        let scenario = last.next().unwrap_or_default();
        PathBuf::from("exports")
            .join(scenario)
            .join(seed)
            .join(format.name())
    });
    let scenario = of_run(&Manifest::of_run(&task.run)?);
    let done = export(&task.run, format, &out, scenario.as_deref())?;
    if done.clipped > 0 {
        note(&format!(
            "{} values are beyond the range of their CAN signal and were limited to this range",
            done.clipped
        ));
    }
    output::print(&format!(
        "{} rows in {}\nmonorig replay --map {}\n",
        done.rows,
        done.folder.display(),
        done.map.display()
    ))?;
    Ok(CommandOutcome::Held)
}
