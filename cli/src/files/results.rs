//! Reading back what a run has left behind: is it there, whole, and ours?

use crate::viewer;
use monorig_logs::export::{SAMPLES, Samples};
use monorig_sim::error::{Error, InputError};
use monorig_sim::record::manifest::{self, Manifest};
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
        name: "samples",
        ending: SAMPLES,
        read: samples,
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

/// Check a file of a run against the manifest beside it, if there is one.
pub fn verify(path: &Path) -> Result<(), Error> {
    let (Some(folder), Some(name)) = (path.parent(), path.file_name()) else {
        return Ok(());
    };
    let manifest = folder.join(manifest::NAME);
    if name == manifest::NAME || !manifest.is_file() {
        return Ok(());
    }
    Manifest::read(&manifest)?.verify(folder, &name.to_string_lossy())
}

/// The kind of a result file, by its name.
pub fn recognise(path: &Path) -> Option<&'static ResultKind> {
    let name = path.file_name()?.to_string_lossy();
    KINDS.iter().find(|k| name.ends_with(k.ending))
}

fn recording(path: &Path) -> Result<String, Error> {
    monorig_sim::config::file::regular(path)?;
    viewer::read(path)
}

fn channels(path: &Path) -> Result<String, Error> {
    monorig_sim::config::file::regular(path)?;
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

fn samples(path: &Path) -> Result<String, Error> {
    monorig_sim::config::file::regular(path)?;
    let found = Samples::open(path)?;
    let mut steps = 0u64;
    found.each(&mut |_| {
        steps += 1;
        Ok(())
    })?;
    Ok(format!(
        "{steps} steps of {} ms",
        found.step_ns as f64 * 1e-6
    ))
}

fn manifest(path: &Path) -> Result<String, Error> {
    let found = Manifest::read(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    for name in found.outputs.keys() {
        found.verify(folder, name)?;
    }
    Ok(format!(
        "{}-{}, monorig {}, {} input files, {} files as the run left them",
        found.scenario,
        found.seed,
        found.monorig,
        found.inputs.len(),
        found.outputs.len()
    ))
}

fn metrics(path: &Path) -> Result<String, Error> {
    let text = monorig_sim::config::file::read_result(path)?;
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
