//! Which scenarios are meant by the paths on the command line.

use crate::ui::errors::CliError;
use monorig_sim::error::{Error, InputError};
use std::path::{Path, PathBuf};

/// The files named, and the `*.yaml` of the folders named, by name; of these, those with `filter` in their name. None at all is
/// an error.
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

fn inside(folder: &Path) -> Result<Vec<PathBuf>, CliError> {
    let failed = |source| Error::Io {
        path: folder.into(),
        source,
    };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let yaml = path.extension().is_some_and(|e| e == "yaml" || e == "yml");
        if yaml && !path.is_dir() {
            files.push(path);
        }
    }
    files.sort();
    if files.is_empty() {
        return Err(nothing(
            folder,
            "there is no scenario in this folder".into(),
        ));
    }
    Ok(files)
}

fn nothing(path: &Path, message: String) -> CliError {
    CliError::Sim(
        InputError {
            file: path.into(),
            line: None,
            column: None,
            key: String::new(),
            message,
            help: "name scenario files (*.yaml), or folders that hold some".into(),
        }
        .into(),
    )
}
