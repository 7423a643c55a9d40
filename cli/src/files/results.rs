//! Reading back what a run has left behind: is it there, whole, and ours?

use crate::viewer;
use monorig_sim::error::{Error, InputError};
use monorig_sim::record::manifest::Manifest;
use monorig_sim::record::readback;
use std::path::Path;

/// Help for a result that cannot be used.
pub const MAKE_AGAIN: &str = "make it again with `monorig run`";

/// A kind of file that a run leaves behind.
pub struct ResultKind {
    /// Its name in messages.
    pub name: &'static str,
    /// What its file name ends with.
    ending: &'static str,
    /// Reads all of it, and says what is in it.
    pub read: fn(&Path) -> Result<String, Error>,
}

const KINDS: &[ResultKind] = &[
    ResultKind {
        name: "recording",
        ending: ".rrd",
        read: recording,
    },
    ResultKind {
        name: "channels",
        ending: ".parquet",
        read: channels,
    },
    ResultKind {
        name: "manifest",
        ending: "manifest.json",
        read: manifest,
    },
    ResultKind {
        name: "metrics",
        ending: "metrics.json",
        read: metrics,
    },
];

/// The kind of a result file, by its name.
pub fn recognise(path: &Path) -> Option<&'static ResultKind> {
    let name = path.file_name()?.to_string_lossy();
    KINDS.iter().find(|k| name.ends_with(k.ending))
}

fn recording(path: &Path) -> Result<String, Error> {
    if !path.is_file() {
        monorig_sim::config::file::read_text(path)?; // says what is there instead
    }
    viewer::read(path)
}

fn channels(path: &Path) -> Result<String, Error> {
    if !path.is_file() {
        monorig_sim::config::file::read_text(path)?; // says what is there instead
    }
    let found = readback::read(path)?;
    Ok(format!(
        "{}-{}, {} columns, {} rows, {} events, complete",
        found.scenario,
        found.seed,
        found.columns.len(),
        found.rows,
        found.events.len()
    ))
}

fn manifest(path: &Path) -> Result<String, Error> {
    let found = Manifest::read(path)?;
    Ok(format!(
        "{}-{}, monorig {}, {} input files",
        found.scenario,
        found.seed,
        found.monorig,
        found.inputs.len()
    ))
}

fn metrics(path: &Path) -> Result<String, Error> {
    let text = monorig_sim::config::file::read_text(path)?;
    let found: serde_json::Value =
        serde_json::from_str(&text).map_err(|e| broken(path, format!("this is not JSON: {e}")))?;
    let (finished, simulated_s) = (&found["finished"], &found["simulated_s"]);
    match (finished.as_bool(), simulated_s.as_f64()) {
        (Some(true), Some(t)) => Ok(format!("finished after {t:.1} s")),
        (Some(false), Some(t)) => Ok(format!("NOT finished: stopped after {t:.1} s")),
        _ => Err(broken(path, "these are not the metrics of a run".into())),
    }
}

fn broken(path: &Path, message: String) -> Error {
    InputError {
        file: path.into(),
        line: None,
        column: None,
        key: String::new(),
        message,
        help: MAKE_AGAIN.into(),
    }
    .into()
}
