//! `monorig check`: find mistakes in files without running anything.

use crate::arguments::Check;
use crate::errors::{self, CliError};
use crate::kinds::{self, KINDS, Row};
use crate::results;
use crate::{Outcome, output};
use monorig_sim::config::file::{Document, input_error};
use monorig_sim::error::Error;
use std::path::Path;

/// Check every file; all mistakes are shown, not only those of the first bad file.
pub fn check(task: &Check) -> Result<Outcome, CliError> {
    let mut bad = 0;
    for file in &task.files {
        match check_one(file, task.kind.and_then(kinds::row)) {
            Ok(found) => output::print(&format!("{}: {found}\n", file.display()))?,
            Err(e) => {
                errors::show(&CliError::Sim(e));
                bad += 1;
            }
        }
    }
    match bad {
        0 => Ok(Outcome::Held),
        _ => Err(CliError::BadFiles {
            bad,
            all: task.files.len(),
        }),
    }
}

/// What was found in a good file.
fn check_one(file: &Path, row: Option<&'static Row>) -> Result<String, Error> {
    if row.is_none()
        && let Some(kind) = results::recognise(file)
    {
        return Ok(format!("{} ok ({})", kind.name, (kind.read)(file)?));
    }
    let row = match row {
        Some(row) => row,
        None => recognise(file)?,
    };
    (row.check)(file)?;
    Ok(format!("{} ok", row.name))
}

fn recognise(file: &Path) -> Result<&'static Row, Error> {
    let keys = Document::read(file)?.keys();
    kinds::recognise(&keys).ok_or_else(|| {
        let names: Vec<_> = KINDS.iter().map(|row| row.name).collect();
        input_error(
            file,
            "",
            "its keys do not tell what kind of file this is",
            format!("say it with --kind, one of: {}", names.join(", ")),
        )
    })
}
