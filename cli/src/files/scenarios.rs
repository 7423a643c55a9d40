//! Scenarios that the command line names.

use crate::files::folders::yaml_files;
use crate::files::formats::{self, FileKind};
use crate::files::share;
use crate::ui::errors::CliError;
use crate::ui::note::note;
use monorig_sim::config::file::{Document, input_error};
use monorig_sim::record::manifest::{Manifest, sum};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Named files, and the scenarios in named folders, sorted by name. A folder without a scenario is an error.
pub fn scenarios(paths: &[PathBuf]) -> Result<Vec<PathBuf>, CliError> {
    let (mut found, mut places) = (Vec::<PathBuf>::new(), BTreeSet::new());
    for path in paths {
        let files = if path.is_dir() {
            inside(path)?
        } else {
            vec![path.clone()]
        };
        for file in files {
            // one file under several names is one
            let place = file.canonicalize().unwrap_or_else(|_| file.clone());
            if places.insert(place) {
                found.push(file);
            }
        }
    }
    Ok(found)
}

/// Largest number of files that are no scenarios in a message.
const NAMED: usize = 3;

/// Scenarios in a folder and its subfolders. Other files of monorig are left out, and a note names the first of these.
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
        let message = "this folder has no scenario".into();
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

/// Kind of a file of monorig that is not a scenario; `None` if the keys do not identify the kind.
fn other_kind(file: &Path) -> Option<&'static str> {
    let keys = Document::read(file).ok()?.keys();
    let format = formats::recognise(&keys)?;
    (format.kind != FileKind::Scenario).then_some(format.name)
}

/// Error if `path` names no scenario.
pub fn nothing(path: &Path, message: String) -> CliError {
    let help = "name scenario files (*.yaml), or folders with scenario files";
    CliError::Sim(input_error(path, "", message, help))
}

/// Scenario file of a run: a file with the run's name and, byte for byte, its content, here or in the folder scenarios.
pub fn of_run(manifest: &Manifest) -> Option<PathBuf> {
    let name = format!("{}.yaml", scenario_name(manifest));
    let wanted = manifest.inputs.get(&name)?;
    let folders = [PathBuf::from("."), share::find("scenarios".into())];
    let mut candidates = folders.into_iter().flat_map(|f| below(&f, &name));
    candidates.find(|file| sum(file).is_ok_and(|sum| sum == *wanted))
}

/// Name of the scenario of a run, without the name of the variant.
pub fn scenario_name(manifest: &Manifest) -> &str {
    manifest.scenario.split('@').next().unwrap_or_default()
}

/// Files of this name in a folder and its subfolders.
fn below(folder: &Path, name: &str) -> Vec<PathBuf> {
    let inside = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut folders: Vec<PathBuf> = inside.map(|e| e.path()).filter(|p| p.is_dir()).collect();
    folders.sort();
    let all = std::iter::once(folder.to_owned()).chain(folders);
    all.map(|f| f.join(name)).filter(|p| p.is_file()).collect()
}
