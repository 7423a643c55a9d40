//! The source itself: what is public, one meaning a name, comments that fit.

#![allow(clippy::unwrap_used)] // helpers of tests

mod modules;
mod public_face;
mod style;
mod type_names;
mod unsafe_code;

use std::path::{Path, PathBuf};

/// The crates of the workspace with a public face, by their folders.
const CRATES: [&str; 6] = ["estimators", "sim", "logs", "lab", "viz", "cli"];

/// The root of the workspace.
fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}
