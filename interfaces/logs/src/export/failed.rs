//! The error of a file that could not be written.

use crate::io;
use monorig_sim::error::Error;
use std::path::Path;

/// The error of a library that could not write a file.
pub(super) fn failed(path: &Path) -> impl Fn(&dyn std::fmt::Display) -> Error {
    move |e| io(path, std::io::Error::other(e.to_string()))
}
