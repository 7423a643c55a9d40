//! Checks of results: does the file exist, is it complete, and is it of monorig?

use crate::files::broken::{MAKE_AGAIN, broken};
use crate::files::written;
use crate::viewer;
use monorig_lab::campaign::{Campaign, CampaignKind, CampaignRow, Rows};
use monorig_lab::explain::Budget;
use monorig_lab::reports::study;
use monorig_lab::stress::StressRun;
use monorig_lab::tuning::trial_store::Trial;
use monorig_lab::verdicts::run_files::CHANNELS;
use monorig_lab::verdicts::summary::Summary;
use monorig_logs::export::{SAMPLES, Samples};
use monorig_sim::config::file::{read_large, read_result, regular};
use monorig_sim::error::Error;
use monorig_sim::record::manifest::{self, Manifest};
use monorig_sim::record::readback;
use serde::de::DeserializeOwned;
use std::collections::BTreeSet;
use std::path::Path;

/// Kind of a result file.
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

/// Ending of files that are results only if they have a key `kind`: a scenario may be written as JSON too.
const ANY_JSON: &str = ".json";

const PARQUET: &str = ".parquet";

/// Files that a run leaves beside its manifest.
const OF_RUN: &[&str] = &[CHANNELS, "metrics.json", SAMPLES, "run.rrd"];

/// All kinds of result files; the first kind that fits a name counts.
const KINDS: &[ResultKind] = &[
    of_run("recording", ".rrd", recording),
    of_run("samples", SAMPLES, samples),
    of_run("channels", PARQUET, channels),
    of_run("manifest", "manifest.json", manifest),
    of_run("metrics", "metrics.json", metrics),
    other("error budget", "explain.json", budget),
    other("trials", "trials.jsonl", lines),
    other("results", ".jsonl", lines),
    other("validation", "validation.json", json),
    other("sensitivity", "sensitivity.json", json),
    other("results", ANY_JSON, lines),
    other("page", ".html", page),
    other("table", ".csv", written::table),
    other("log", ".mat", written::log),
    other("log", ".mcap", written::log),
    other("log", ".mf4", written::log),
    other("log", ".log", written::log),
    other("CAN database", ".dbc", written::database),
    other("verdicts", ".xml", written::junit),
];

/// Table in Parquet that does not belong to a run, as `monorig log export` writes it.
const LOG: ResultKind = other("log", "", written::log);

/// Copies of the inputs of a study, named by their check sum.
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

/// Checks a file of a run against the manifest beside it, if there is a manifest.
pub fn verify(path: &Path) -> Result<(), Error> {
    let (Some(folder), Some(name)) = (path.parent(), path.file_name()) else {
        return Ok(());
    };
    let manifest = folder.join(manifest::NAME);
    if name == manifest::NAME || !manifest.is_file() {
        return Ok(());
    }
    Manifest::of_run(folder)?.verify(folder, &name.to_string_lossy())
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
    if Campaign::read(path).is_ok() {
        return true;
    }
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
        "{}-{}, {} columns, {} rows, {} events, {}",
        found.scenario,
        found.seed,
        found.columns.len(),
        found.rows,
        found.events.len(),
        match path.with_file_name(manifest::NAME).is_file() {
            true => "complete",
            false => "not verified: no manifest.json with its check sum is in this folder",
        }
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
    let folder = path.parent().unwrap_or(Path::new(""));
    let found = match path.file_name() {
        Some(name) if name == manifest::NAME => Manifest::of_run(folder)?,
        _ => Manifest::read(path)?,
    };
    // those that the manifest names, and those of a run that it should name
    let there = OF_RUN
        .iter()
        .copied()
        .filter(|name| folder.join(name).is_file());
    let named = found.outputs.keys().map(String::as_str);
    for name in named.chain(there).collect::<BTreeSet<&str>>() {
        found.verify(folder, name)?;
    }
    let channels_path = folder.join(CHANNELS);
    if channels_path.is_file() {
        let of = readback::read(&channels_path)?;
        if (&of.scenario, &of.seed) != (&found.scenario, &found.seed.to_string()) {
            let message = format!(
                "{CHANNELS} in this folder is of {} seed {}",
                of.scenario, of.seed
            );
            return Err(broken(path, message));
        }
    }
    Ok(format!(
        "{}-{}, {} files as the run wrote them; by its own statement made by monorig {} from {} input files",
        found.scenario,
        found.seed,
        found.outputs.len(),
        found.monorig,
        found.inputs.len()
    ))
}

/// Reads JSON; `wrong` is the message if the content is of another kind.
fn parsed<T: DeserializeOwned>(path: &Path, wrong: &str) -> Result<T, Error> {
    let text = read_result(path)?;
    serde_json::from_str(&text).map_err(|e| broken(path, format!("{wrong}: {e}")))
}

fn metrics(path: &Path) -> Result<String, Error> {
    let found: Summary = parsed(path, "these are not the metrics of a run")?;
    found.check().map_err(|message| broken(path, message))?;
    let t = found.simulated_s;
    Ok(match found.finished {
        true => format!("finished after {t:.1} s"),
        false => format!("NOT finished: stopped after {t:.1} s"),
    })
}

fn budget(path: &Path) -> Result<String, Error> {
    let found: Budget = parsed(path, "this is not an error budget")?;
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

/// Reads results in JSON lines: trials, or those of a command that makes many runs.
fn lines(path: &Path) -> Result<String, Error> {
    let rows = |n: usize, what: &str, of: &Campaign| format!("{n} {what} of {}", of.name);
    let of = match Campaign::read(path) {
        Err(_) if !is_lines(path) => return many_runs(path),
        of => of?,
    };
    Ok(match of.kind {
        CampaignKind::Tune => rows(count::<Trial>(path, of.kind)?, "trials", &of),
        CampaignKind::Stress => rows(count::<StressRun>(path, of.kind)?, "runs", &of),
        CampaignKind::Test | CampaignKind::Study => return many_runs(path),
    })
}

fn is_lines(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "jsonl")
}

fn count<R: CampaignRow>(path: &Path, kind: CampaignKind) -> Result<usize, Error> {
    let rows = Rows::<R>::open(path, &[kind])?;
    let rows: Result<Vec<()>, Error> = rows.map(|row| row.map(drop)).collect();
    Ok(rows?.len())
}

fn json(path: &Path) -> Result<String, Error> {
    let found: serde_json::Value = parsed(path, "this is not JSON")?;
    Ok(match &found {
        serde_json::Value::Array(items) => format!("{} entries", items.len()),
        serde_json::Value::Object(keys) => format!("{} keys", keys.len()),
        _ => return Err(broken(path, "these are not results".into())),
    })
}

fn page(path: &Path) -> Result<String, Error> {
    let bytes = read_large(path)?;
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
        (false, _) => Err(broken(path, "this page was not written by monorig".into())),
    }
}
