//! Scenarios that the paths on the command line name.

use crate::files::folders::yaml_files;
use crate::files::formats::{self, FileKind};
use crate::files::share;
use crate::ui::errors::CliError;
use crate::ui::note::note;
use monorig_sim::config::file::{Document, input_error};
use monorig_sim::record::manifest::{Manifest, sum};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The files named, and the scenarios in the folders named, by name. A folder without any is an error.
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

/// The error where no scenario is left of what `path` names.
pub fn nothing(path: &Path, message: String) -> CliError {
    let help = "name scenario files (*.yaml), or folders that hold some";
    CliError::Sim(input_error(path, "", message, help))
}

/// The scenario file of a run: one that has its name and, byte for byte, its content, here or in the folder scenarios.
pub fn of_run(manifest: &Manifest) -> Option<PathBuf> {
    let name = format!("{}.yaml", scenario_name(manifest));
    let wanted = manifest.inputs.get(&name)?;
    let folders = [PathBuf::from("."), share::find("scenarios".into())];
    let mut candidates = folders.into_iter().flat_map(|f| below(&f, &name));
    candidates.find(|file| sum(file).is_ok_and(|sum| sum == *wanted))
}

/// Name of the scenario of a run, without that of the variant.
pub fn scenario_name(manifest: &Manifest) -> &str {
    manifest.scenario.split('@').next().unwrap_or_default()
}

/// Files of this name in a folder and in the folders in it.
fn below(folder: &Path, name: &str) -> Vec<PathBuf> {
    let inside = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut folders: Vec<PathBuf> = inside.map(|e| e.path()).filter(|p| p.is_dir()).collect();
    folders.sort();
    let all = std::iter::once(folder.to_owned()).chain(folders);
    all.map(|f| f.join(name)).filter(|p| p.is_file()).collect()
}
