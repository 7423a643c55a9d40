//! Paths and YAML files in a folder.

use monorig_sim::error::Error;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Paths in a folder, by name, without hidden ones.
pub fn entries(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let failed = Error::at(folder);
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(&failed)? {
        let entry = entry.map_err(&failed)?;
        let hidden = entry.file_name().as_encoded_bytes().starts_with(b".");
        found.extend((!hidden).then(|| entry.path()));
    }
    found.sort();
    Ok(found)
}

/// The YAML files in a folder and in the folders in it, by name.
pub fn yaml_files(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    inside(folder, &mut BTreeSet::new())
}

/// Reads each folder only once: links could form a circle.
fn inside(folder: &Path, seen: &mut BTreeSet<PathBuf>) -> Result<Vec<PathBuf>, Error> {
    let place = folder.canonicalize().map_err(Error::at(folder))?;
    let mut files = Vec::new();
    if !seen.insert(place) {
        return Ok(files);
    }
    for path in entries(folder)? {
        if path.is_dir() {
            files.extend(inside(&path, seen)?);
        } else if is_yaml(&path) && !path.is_dir() {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

fn is_yaml(path: &Path) -> bool {
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    ["yaml", "yml"].contains(&ending.to_lowercase().as_str())
}
