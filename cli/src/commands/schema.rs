//! `monorig schema`: the JSON Schema of a file format.

use crate::command::{Command, CommandOutcome, Program};
use crate::files::formats::FileKind;
use crate::files::formats::{self, KINDS};
use crate::ui::errors::CliError;
use crate::ui::output;
use monorig_sim::closed_loop::registry::Registry;

/// Print the JSON Schema of a file format: every key, its meaning and its unit.
#[derive(Debug, clap::Parser)]
#[command(
    name = "schema",
    after_help = "Examples:\n  monorig schema                   the kinds there are\n  monorig schema scenario > scenario.json\n\n\
    An editor with the YAML language server completes and checks the keys of a file\nwhose first line is\n\n  \
    # yaml-language-server: $schema=scenario.json"
)]
pub struct SchemaArgs {
    /// Kind of file; without it the kinds are listed
    pub kind: Option<FileKind>,
}

impl Command for SchemaArgs {
    fn run(&self, program: &Program<'_>) -> Result<CommandOutcome, CliError> {
        schema(self, program.registry)
    }
}

/// Print a schema, or the list of kinds.
fn schema(task: &SchemaArgs, registry: &Registry) -> Result<CommandOutcome, CliError> {
    let text = match task.kind.and_then(formats::row) {
        Some(row) => serde_json::to_string_pretty(&row.schema(registry)).map_err(CliError::json)?,
        None => {
            let lines = KINDS
                .iter()
                .map(|row| format!("{:<14}{}", row.name, row.about));
            lines.collect::<Vec<_>>().join("\n")
        }
    };
    output::print(&format!("{text}\n"))?;
    Ok(CommandOutcome::Held)
}
