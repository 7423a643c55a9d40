//! `monorig schema`: the JSON Schema of a file format.

use crate::arguments::Schema;
use crate::errors::CliError;
use crate::kinds::{self, KINDS};
use crate::{Outcome, output};

/// Print a schema, or the list of kinds.
pub fn schema(task: &Schema) -> Result<Outcome, CliError> {
    let text = match task.kind.and_then(kinds::row) {
        Some(row) => serde_json::to_string_pretty(&(row.schema)()).map_err(CliError::Json)?,
        None => {
            let lines = KINDS
                .iter()
                .map(|row| format!("{:<14}{}", row.name, row.about));
            lines.collect::<Vec<_>>().join("\n")
        }
    };
    output::print(&format!("{text}\n"))?;
    Ok(Outcome::Held)
}
