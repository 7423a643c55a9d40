//! The source itself: what is public, one meaning a name, comments that fit, no circles of files or rooms.

mod arrows;
mod modules;
mod public_face;
mod style;
mod type_names;
mod unsafe_code;

use std::path::{Path, PathBuf};

/// The root of the workspace.
fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Folders of the members of the workspace, as its manifest lists them.
fn members() -> Vec<String> {
    let manifest = std::fs::read_to_string(project().join("Cargo.toml")).unwrap();
    let line = manifest.lines().find(|l| l.starts_with("members = ["));
    let names = line.unwrap().split('"').skip(1).step_by(2);
    names.map(str::to_owned).collect()
}

/// Folders of the members that have a library in `src`.
fn libraries() -> Vec<String> {
    let has_library = |folder: &String| project().join(folder).join("src/lib.rs").exists();
    let found: Vec<String> = members().into_iter().filter(has_library).collect();
    assert!(found.len() > 10, "{found:?}");
    found
}
