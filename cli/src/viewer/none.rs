//! Without the viewer.

use monorig_sim::config::file::input_error;
use monorig_sim::error::Error;
use monorig_sim::record::Sink;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

/// Length of the chunks of a recording that is watched, s: as with the viewer.
pub const LIVE_CHUNK_S: f64 = 10.0;

/// No recording.
pub fn sink(
    _path: PathBuf,
    _live: Option<SocketAddr>,
    _full_rate: bool,
) -> Option<Box<dyn Sink + Send>> {
    None
}

/// Refuses to read a recording.
pub fn read(path: &Path, _make_again: &str) -> Result<String, Error> {
    Err(input_error(
        path,
        "",
        "this program was built without the viewer, so it cannot read recordings",
        "a `monorig` built with the feature `viewer`",
    ))
}
