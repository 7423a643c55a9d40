//! `monorig new scenario`: the smallest scenario under another name, with the text of the schema above each key.

use super::estimator::copy::{sources, way};
use crate::command::CommandOutcome;
use crate::files::formats::{FileKind, row};
use crate::files::prepare;
use crate::ui::errors::CliError;
use crate::ui::output;
use monorig_lab::text::quoted;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::config::file::read_text;
use serde_json::Value;
use std::path::PathBuf;

const SCENARIO_EXAMPLES: &str = "\
Examples:
  monorig new scenario hill   writes hill.yaml, which runs as it is
  monorig run hill.yaml";

const MINIMAL: (&str, &[&str]) = ("scenarios", &["minimal.yaml"]);

/// Columns of a line of comment.
const WIDTH: usize = 100;

/// Write a scenario that can be run, with a comment above each key.
#[derive(Debug, clap::Args)]
#[command(after_help = SCENARIO_EXAMPLES)]
pub struct NewScenarioArgs {
    /// Name of the scenario, or the file to write
    pub name: PathBuf,
    /// Folder of monorig's sources, to which the scenario refers [default: the nearest one at or above this folder or
    /// NAME]
    #[arg(long, value_name = "DIR")]
    pub monorig: Option<PathBuf>,
}

/// Writes the file and checks it.
pub fn run(task: &NewScenarioArgs, registry: &Registry) -> Result<CommandOutcome, CliError> {
    let path = task.name.with_extension("yaml");
    if path.symlink_metadata().is_ok() {
        let message = format!("{} exists already", path.display());
        return Err(CliError::refused(message, "another name"));
    }
    let here = std::path::absolute(".").unwrap_or_default();
    let file = here.join(&path);
    let folder = file.parent().unwrap_or(&here);
    let sources = sources(MINIMAL, task.monorig.as_deref(), [&here, folder])?;
    let text = read_text(&sources.join("scenarios/minimal.yaml"))?;
    let text = text.replace("../", &way(folder, &sources)?);
    output::write(&path, &commented(&text, registry))?;
    if let Err(e) = prepare::simulation(&path, &[], registry) {
        // of a file that cannot be used nothing is left
        let _ = std::fs::remove_file(&path);
        return Err(e.into());
    }
    let name = quoted(&path.to_string_lossy());
    output::print(&format!("made {name}\nnext: monorig run {name}\n"))?;
    Ok(CommandOutcome::Held)
}

/// The text with a comment above each key, followed by the keys that the text does not have.
fn commented(text: &str, registry: &Registry) -> String {
    let schema = row(FileKind::Scenario).map(|row| row.schema(registry));
    let keys = schema.as_ref().and_then(|schema| schema.get("properties"));
    let about = |key: &str| {
        let about = keys?.get(key)?.get("description")?.as_str()?;
        Some(about.split_whitespace().collect::<Vec<_>>().join(" "))
    };
    let comment = |text: &str| {
        let options = textwrap::Options::new(WIDTH)
            .initial_indent("# ")
            .subsequent_indent("# ");
        textwrap::fill(text, options) + "\n"
    };
    let mut out = String::new();
    let mut there = Vec::new();
    for line in text.lines() {
        // the comments of the original say what it is for
        if line.starts_with('#') && !line.contains("$schema") {
            continue;
        }
        let key = line.split_once(':').map_or("", |(key, _)| key);
        if let Some(about) = about(key) {
            out += &format!("\n{}", comment(&about));
            there.push(key);
        }
        out += &format!("{line}\n");
    }
    out += "\n# Further keys:\n";
    let all = keys.and_then(Value::as_object).into_iter().flatten();
    for (key, _) in all.filter(|(key, _)| !there.contains(&key.as_str())) {
        out += &comment(&format!("{key}: {}", about(key).unwrap_or_default()));
    }
    out
}
