//! Reading back what was written: is it there, whole, and ours?

use crate::files::broken::{MAKE_AGAIN, broken};
use crate::files::written;
use crate::viewer;
use monorig_lab::explain::Budget;
use monorig_lab::reports::study;
use monorig_lab::tuning::trial_store::{Trial, TrialsHeader};
use monorig_logs::export::{SAMPLES, Samples};
use monorig_sim::config::file::{read_result, regular};
use monorig_sim::error::Error;
use monorig_sim::record::manifest::{self, Manifest};
use monorig_sim::record::readback;
use std::path::Path;

/// A kind of file that a command leaves behind.
pub struct ResultKind {
    /// Its name in messages.
    pub name: &'static str,
    /// End of its file name.
    ending: &'static str,
    /// Reads all of it, and describes its content.
    pub read: Read,
    /// True for files of a run, whose check sums are in the manifest.
    pub of_run: bool,
}

/// Files of this ending are results only if their key `kind` marks them: a scenario may be written as JSON too.
const ANY_JSON: &str = ".json";

const PARQUET: &str = ".parquet";
/// File name of the channels of a run.
const CHANNELS: &str = "channels.parquet";

/// The first that fits a name counts.
const KINDS: &[ResultKind] = &[
    of_run("recording", ".rrd", recording),
    of_run("samples", SAMPLES, samples),
    of_run("channels", PARQUET, channels),
    of_run("manifest", "manifest.json", manifest),
    of_run("metrics", "metrics.json", metrics),
    other("error budget", "explain.json", budget),
    other("trials", "trials.jsonl", trials),
    other("results", ".jsonl", many_runs),
    other("validation", "validation.json", json),
    other("sensitivity", "sensitivity.json", json),
    other("results", ANY_JSON, many_runs),
    other("page", ".html", page),
    other("table", ".csv", written::table),
    other("log", ".mcap", written::log),
    other("log", ".mf4", written::log),
    other("log", ".log", written::log),
    other("CAN database", ".dbc", written::database),
    other("verdicts", ".xml", written::junit),
];

/// A table in Parquet that is not of a run, as `monorig export` writes them.
const LOG: ResultKind = other("log", "", written::log);

/// Copies of the inputs of a study, which are called by their check sum.
const COPY: ResultKind = other("copy of an input", "", written::copy);

type Read = fn(&Path) -> Result<String, Error>;

const fn of_run(name: &'static str, ending: &'static str, read: Read) -> ResultKind {
    ResultKind {
        name,
        ending,
        read,
        of_run: true,
    }
}

const fn other(name: &'static str, ending: &'static str, read: Read) -> ResultKind {
    ResultKind {
        name,
        ending,
        read,
        of_run: false,
    }
}

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
    if written::is_copy(&name) {
        return Some(&COPY);
    }
    if name.ends_with(PARQUET) && name != CHANNELS && !name.ends_with(SAMPLES) {
        let of_run = readback::read(path).is_ok();
        if !of_run && written::log(path).is_ok() {
            return Some(&LOG);
        }
    }
    let found = KINDS.iter().find(|k| name.ends_with(k.ending))?;
    (found.ending != ANY_JSON || has_results(path)).then_some(found)
}

/// Returns whether a JSON file was written by `test --json` or `compare --json`.
fn has_results(path: &Path) -> bool {
    let value = read_result(path).ok();
    let value = value.and_then(|text| serde_json::from_str::<serde_json::Value>(&text).ok());
    value.is_some_and(|v| ["test", "compare"].contains(&v["kind"].as_str().unwrap_or_default()))
}

fn recording(path: &Path) -> Result<String, Error> {
    regular(path)?;
    viewer::read(path, MAKE_AGAIN)
}

fn channels(path: &Path) -> Result<String, Error> {
    regular(path)?;
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
    let steps = found.count()?;
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
    let text = read_result(path)?;
    let found: serde_json::Value =
        serde_json::from_str(&text).map_err(|e| broken(path, format!("this is not JSON: {e}")))?;
    let (finished, simulated_s) = (&found["finished"], &found["simulated_s"]);
    match (finished.as_bool(), simulated_s.as_f64()) {
        (Some(true), Some(t)) => Ok(format!("finished after {t:.1} s")),
        (Some(false), Some(t)) => Ok(format!("NOT finished: stopped after {t:.1} s")),
        _ => Err(broken(path, "these are not the metrics of a run".into())),
    }
}

fn budget(path: &Path) -> Result<String, Error> {
    let text = read_result(path)?;
    let found: Budget = serde_json::from_str(&text)
        .map_err(|e| broken(path, format!("this is not an error budget: {e}")))?;
    Ok(format!(
        "{}, {} sources of error over {} seeds",
        found.scenario,
        found.sources.len(),
        found.seeds.len()
    ))
}

/// Reads results of a study, of `test --json` or of `compare --json`.
fn many_runs(path: &Path) -> Result<String, Error> {
    let page = study::page(path)?;
    Ok(format!("{}: {}", page.title, page.subtitle))
}

fn trials(path: &Path) -> Result<String, Error> {
    let text = read_result(path)?;
    let mut lines = text.lines();
    let header: TrialsHeader = serde_json::from_str(lines.next().unwrap_or_default())
        .map_err(|e| broken(path, format!("line 1 is not the head of trials: {e}")))?;
    let mut count = 0;
    for (line, number) in lines.zip(2..) {
        serde_json::from_str::<Trial>(line)
            .map_err(|e| broken(path, format!("line {number} is not a trial: {e}")))?;
        count += 1;
    }
    Ok(format!("{count} trials of {}", header.study))
}

fn json(path: &Path) -> Result<String, Error> {
    let text = read_result(path)?;
    let found: serde_json::Value =
        serde_json::from_str(&text).map_err(|e| broken(path, format!("this is not JSON: {e}")))?;
    Ok(match &found {
        serde_json::Value::Array(items) => format!("{} entries", items.len()),
        serde_json::Value::Object(keys) => format!("{} keys", keys.len()),
        _ => return Err(broken(path, "these are no results".into())),
    })
}

fn page(path: &Path) -> Result<String, Error> {
    let failed = |source| Error::Io {
        path: path.into(),
        source,
    };
    regular(path)?;
    let bytes = std::fs::read(path).map_err(failed)?;
    let text = String::from_utf8_lossy(&bytes);
    let begins = |word: &str| {
        text.get(..word.len())
            .is_some_and(|t| t.eq_ignore_ascii_case(word))
    };
    match (
        begins("<!doctype html>"),
        text.trim_end().ends_with("</html>"),
    ) {
        (true, true) => Ok(format!("{:.1} MB", bytes.len() as f64 / 1e6)),
        (true, false) => Err(broken(path, "this page breaks off".into())),
        (false, _) => Err(broken(path, "this is not a page of ours".into())),
    }
}
