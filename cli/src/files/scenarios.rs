//! Scenarios that the paths on the command line name.

use crate::files::folders::yaml_files;
use crate::files::formats::{self, FileKind};
use crate::ui::errors::CliError;
use crate::ui::note::note;
use monorig_sim::config::file::{Document, input_error};
use std::path::{Path, PathBuf};

/// The files named, and the scenarios in the folders named, by name; of these, those with `filter` in their name. None
/// at all is an error.
pub fn scenarios(paths: &[PathBuf], filter: Option<&str>) -> Result<Vec<PathBuf>, CliError> {
    let mut found: Vec<PathBuf> = Vec::new();
    for path in paths {
        let files = if path.is_dir() {
            inside(path)?
        } else {
            vec![path.clone()]
        };
        for file in files {
            if !found.contains(&file) {
                found.push(file);
            }
        }
    }
    let Some(text) = filter else {
        return Ok(found);
    };
    let all = found.len();
    found.retain(|file| {
        let stem = file.file_stem().unwrap_or_default();
        stem.to_string_lossy().contains(text)
    });
    if found.is_empty() {
        return Err(nothing(
            paths.first().map_or(Path::new(""), PathBuf::as_path),
            format!("none of {all} scenarios has `{text}` in its name"),
        ));
    }
    Ok(found)
}

/// Files that are no scenarios and are named.
const NAMED: usize = 3;

/// The scenarios in a folder and the folders in it. Other files of ours that are there are left out,
/// and the first of them named.
fn inside(folder: &Path) -> Result<Vec<PathBuf>, CliError> {
    let mut files = yaml_files(folder)?;
    let mut others = Vec::new();
    files.retain(|file| match other_kind(file) {
        Some(kind) => {
            others.push(format!("{} ({kind})", file.display()));
            false
        }
        None => true,
    });
    if files.is_empty() {
        let message = "there is no scenario in this folder".into();
        return Err(nothing(folder, message));
    }
    if !others.is_empty() {
        let more = others.len().saturating_sub(NAMED);
        others.truncate(NAMED);
        others.extend((more > 0).then(|| format!("{more} more")));
        note(&format!("not scenarios, left out: {}", others.join(", ")));
    }
    Ok(files)
}

/// The kind of a file of ours that is no scenario; none if its keys do not decide it.
fn other_kind(file: &Path) -> Option<&'static str> {
    let keys = Document::read(file).ok()?.keys();
    let format = formats::recognise(&keys)?;
    (format.kind != FileKind::Scenario).then_some(format.name)
}

fn nothing(path: &Path, message: String) -> CliError {
    let help = "name scenario files (*.yaml), or folders that hold some";
    CliError::Sim(input_error(path, "", message, help))
}
