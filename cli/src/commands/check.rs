//! `monorig check`: find mistakes in files without running anything.

use crate::arguments::Foreign;
use crate::command::{Command, CommandOutcome, Program};
use crate::files::formats::FileKind;
use crate::files::formats::{self, FileFormat, KINDS};
use crate::files::results;
use crate::files::share;
use crate::ui::errors::{self, CliError};
use crate::ui::output;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::config::file::{Document, input_error};
use monorig_sim::error::Error;
use std::path::Path;
use std::path::PathBuf;

const CHECK_EXAMPLES: &str = "\
Examples:
  monorig check scenarios/*.yaml
      a scenario with everything it names, as before a run
  monorig check assets/*/*.yaml
      tracks, trains, units, sensor sheets, rail profiles by themselves
  monorig check --kind track assets/tracks/winding.yaml
  monorig check runs/liu2023_section1/1/*
      what a run left behind: whole and readable?
  monorig check scenarios/minimal.yaml --vehicle c > vehicle.h
      its vehicle for a program in C
  monorig check --schema scenario > scenario.json
      every key of a scenario; an editor with the YAML language server completes
      the keys of a file that begins with
      # yaml-language-server: $schema=scenario.json";

/// Check files without running anything.
#[derive(Debug, clap::Parser)]
#[command(name = "check", after_help = CHECK_EXAMPLES)]
pub struct CheckArgs {
    /// Files to check; monorig finds the kind of a file from its keys, the kind of a result from its name
    #[arg(required_unless_present = "schema", value_parser = share::named())]
    pub files: Vec<PathBuf>,
    /// Kind of the files, if their keys do not show it
    #[arg(long)]
    pub kind: Option<FileKind>,
    /// Print the JSON Schema of a kind of files: every key, its meaning and its unit; without KIND the kinds are listed
    #[arg(long, value_name = "KIND", num_args = 0..=1, conflicts_with = "files")]
    pub schema: Option<Option<FileKind>>,
    /// Print the nominal vehicle of a scenario for a program with monorig_estimator.h, or for firmware
    #[cfg(feature = "plugins")]
    #[arg(long, value_name = "LANGUAGE", value_parser = ["c"], conflicts_with_all = ["kind", "schema"])]
    pub vehicle: Option<String>,
    #[command(flatten)]
    pub foreign: Foreign,
}

impl Command for CheckArgs {
    fn run(&self, program: &Program<'_>) -> Result<CommandOutcome, CliError> {
        #[cfg(feature = "plugins")]
        if self.vehicle.is_some() {
            for file in &self.files {
                output::print(&monorig_plugin::in_c(&monorig_fmu::vehicle(file)?))?;
            }
            return Ok(CommandOutcome::Held);
        }
        match self.schema {
            Some(kind) => schema(kind, program.registry),
            None => check(self, &self.foreign.registry(program.registry, [])),
        }
    }
}

/// Prints a schema, or the list of kinds.
fn schema(kind: Option<FileKind>, registry: &Registry) -> Result<CommandOutcome, CliError> {
    let text = match kind.and_then(formats::row) {
        Some(row) => serde_json::to_string_pretty(&row.schema(registry)).map_err(CliError::json)?,
        None => {
            let line = |row: &FileFormat| format!("{:<14}{}", row.name, row.about);
            KINDS.iter().map(line).collect::<Vec<_>>().join("\n")
        }
    };
    output::print(&format!("{text}\n"))?;
    Ok(CommandOutcome::Held)
}

/// Check every file; the mistakes of all bad files are shown, not only of the first.
fn check(task: &CheckArgs, registry: &Registry) -> Result<CommandOutcome, CliError> {
    let mut bad = 0;
    for file in &task.files {
        match check_one(file, task.kind.and_then(formats::row), registry) {
            Ok(found) => output::print(&format!("{}: {found}\n", file.display()))?,
            Err(e) => {
                errors::show(&CliError::Sim(e));
                bad += 1;
            }
        }
    }
    match bad {
        0 => Ok(CommandOutcome::Held),
        _ => Err(CliError::BadFiles {
            bad,
            all: task.files.len(),
        }),
    }
}

/// Checks a file; returns a description of a good one.
fn check_one(
    file: &Path,
    row: Option<&'static FileFormat>,
    registry: &Registry,
) -> Result<String, Error> {
    if row.is_none()
        && let Some(kind) = results::recognise(file)
    {
        // its check sum first: readers of libraries trust the lengths in a file
        if kind.of_run && file.is_file() {
            results::verify(file)?;
        }
        let found = (kind.read)(file)?;
        return Ok(format!("{} ok ({found})", kind.name));
    }
    let row = match row {
        Some(row) => row,
        None => {
            let document = Document::read(file)?;
            recognise(file, &document.keys())?
        }
    };
    (row.check)(file, registry)?;
    Ok(format!("{} ok", row.name))
}

fn recognise(file: &Path, keys: &[String]) -> Result<&'static FileFormat, Error> {
    formats::recognise(keys).ok_or_else(|| {
        let names: Vec<_> = KINDS.iter().map(|row| row.name).collect();
        input_error(
            file,
            "",
            "the keys do not show what kind of file this is",
            format!("name the kind with --kind, one of: {}", names.join(", ")),
        )
    })
}
