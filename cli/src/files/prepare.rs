//! Checks of a scenario or a tuning study that need no run.

use crate::files::formats::{self, FileKind};
use crate::files::load;
use monorig_lab::batch::Plan;
use monorig_lab::tuning::TuningStudy;
use monorig_sim::closed_loop::Simulation;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::config::file::{Document, Sets};
use monorig_sim::config::scenario::Scenario;
use monorig_sim::error::Error;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Read a scenario with `--set` applied, and every file it names; check them against each other by building the
/// simulation of its first seed.
pub fn simulation(
    path: &Path,
    overrides: &[(String, String)],
    registry: &Registry,
) -> Result<Simulation, Error> {
    changed(path, &Sets::new(overrides), registry)
}

/// Reads and checks a scenario with changes, which may come from another file.
pub fn changed(path: &Path, changes: &Sets, registry: &Registry) -> Result<Simulation, Error> {
    let scenario = Scenario::load_with(path, changes);
    let scenario = scenario.map_err(|e| mistaken(e, path, FileKind::Scenario))?;
    load::built(scenario, registry)
}

/// Read a tuning study and every file it names, and check them.
pub fn tuning(path: &Path, registry: &Registry) -> Result<TuningStudy, Error> {
    TuningStudy::load(path, registry).map_err(|e| mistaken(e, path, FileKind::Tuning))
}

/// Read a study and every file it names, and check them.
pub fn study(path: &Path, registry: &Registry) -> Result<Plan, Error> {
    Plan::load(path, registry).map_err(|e| mistaken(e, path, FileKind::Study))
}

/// Read a scenario and every file it names, to be run at every point of a grid of values.
pub fn sweep(
    path: &Path,
    sets: &[(String, String)],
    grid: BTreeMap<String, Vec<Value>>,
    registry: &Registry,
) -> Result<Plan, Error> {
    let plan = Plan::sweep(path, sets, grid, registry);
    plan.map_err(|e| mistaken(e, path, FileKind::Scenario))
}

/// Error of a file that is missing, or is of another kind than `wanted`; the help proposes what the user may have
/// meant.
fn mistaken(mut error: Error, path: &Path, wanted: FileKind) -> Error {
    let Error::Input(input) = &mut error else {
        return error;
    };
    if input.file != path {
        return error;
    }
    let named = |name: PathBuf| [name.clone(), Path::new("scenarios").join(name)];
    let mut near = named(path.with_extension("yaml")).into_iter();
    if !path.exists() {
        if let Some(near) = near.find(|p| p.is_file()) {
            input.help = format!("did you mean `{}`?", near.display());
        }
    } else if let Ok(document) = Document::read(path)
        && let Some(found) = formats::recognise(&document.keys())
        && let Some(row) = formats::row(wanted)
        && found.kind != wanted
    {
        let command = match found.kind {
            FileKind::Scenario => "; `monorig run` takes it",
            FileKind::Tuning => "; `monorig tune` takes it",
            FileKind::Study => "; `monorig study` takes it",
            FileKind::Map => "; `monorig replay --map` takes it",
            _ => "",
        };
        input.help = format!(
            "this file is of the kind {}, but this command needs the kind {}{command}",
            found.name, row.name
        );
    }
    error
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_another_kind_or_a_name_that_lacks_its_ending_is_told() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("hill.yaml");
        std::fs::write(&path, "version: 1\nwhy: w\ntrack: t\ntrain: t\nstop: {}\n").unwrap();
        let registry = Registry::default();
        let help = |e: Error| match e {
            Error::Input(input) => input.help.clone(),
            other => panic!("{other}"),
        };
        let told = tuning(&path, &registry).map(drop).unwrap_err();
        assert!(help(told).contains("kind scenario"));
        let told = study(&path, &registry).map(drop).unwrap_err();
        assert!(help(told).contains("`monorig run` takes it"));
        let bare = dir.path().join("hill");
        let told = simulation(&bare, &[], &registry).map(drop).unwrap_err();
        assert!(help(told).contains("hill.yaml"));
    }
}
