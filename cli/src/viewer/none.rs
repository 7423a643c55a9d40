//! Without the viewer.

use monorig_sim::config::file::input_error;
use monorig_sim::error::Error;
use monorig_sim::record::Sink;
use std::path::{Path, PathBuf};

/// Length of the recording's chunks, s: as with the viewer.
pub fn chunk_s(_live: bool) -> f64 {
    30.0
}

/// No recording.
pub fn sink(_path: PathBuf, _live: bool) -> Option<Box<dyn Sink>> {
    None
}

/// A recording cannot be read.
pub fn read(path: &Path) -> Result<String, Error> {
    Err(input_error(
        path,
        "",
        "this program was built without the viewer, so it cannot read recordings",
        "a `monorig` built with the feature `viewer`",
    ))
}
