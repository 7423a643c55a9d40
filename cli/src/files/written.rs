//! Files that commands write beside their results: tables, logs, verdicts for CI servers, copies of inputs.

use crate::files::broken::broken;
use monorig_logs::check::inspect;
use monorig_logs::read::{Database, ReadOptions, TimeUnit};
use monorig_sim::config::file::{read_result, regular};
use monorig_sim::error::Error;
use monorig_sim::record::manifest::sum;
use std::path::{Path, PathBuf};

/// Hexadecimal digits of a SHA-256.
const DIGITS: usize = 64;

/// A table (CSV): every row has as many cells as the first.
pub fn table(path: &Path) -> Result<String, Error> {
    regular(path)?;
    let failed = |e: csv::Error| broken(path, format!("this table cannot be read: {e}"));
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_path(path)
        .map_err(failed)?;
    let columns = reader.headers().map_err(failed)?.len();
    let mut rows = 0u64;
    let mut row = csv::ByteRecord::new();
    while reader.read_byte_record(&mut row).map_err(failed)? {
        rows += 1;
    }
    match columns {
        0 => Err(broken(path, "this table is empty".into())),
        _ => Ok(format!("{columns} columns, {rows} rows")),
    }
}

/// A recorded log. A log of a CAN bus is read with the database beside it.
pub fn log(path: &Path) -> Result<String, Error> {
    let options = ReadOptions {
        dbc: beside(path, "dbc"),
        ..ReadOptions::default()
    };
    // tables that `monorig log export` writes have a stamp of their own
    let stamped = ReadOptions {
        time: Some("stamp_ns".into()),
        unit: Some(TimeUnit::Nanoseconds),
        ..ReadOptions::default()
    };
    let found = inspect(path, &options).or_else(|e| inspect(path, &stamped).map_err(|_| e))?;
    let rows: u64 = found.tables.iter().map(|t| t.rows).sum();
    let tables = found.tables.len();
    Ok(format!("{}, {tables} tables, {rows} rows", found.format))
}

/// The only file with this ending in the folder of a file.
fn beside(path: &Path, ending: &str) -> Option<PathBuf> {
    let entries = path.parent()?.read_dir().ok()?.flatten();
    let mut found = entries
        .map(|e| e.path())
        .filter(|p| p.extension().is_some_and(|e| e == ending));
    found.next().filter(|_| found.next().is_none())
}

/// A database of CAN messages.
pub fn database(path: &Path) -> Result<String, Error> {
    regular(path)?;
    Ok(format!("{} messages", Database::load(path)?.count()))
}

/// Verdicts as JUnit XML.
pub fn junit(path: &Path) -> Result<String, Error> {
    let text = read_result(path)?;
    let report = quick_junit::Report::deserialize_from_str(&text)
        .map_err(|e| broken(path, format!("this is not JUnit XML: {e}")))?;
    let cases: usize = report.test_suites.iter().map(|s| s.test_cases.len()).sum();
    Ok(format!(
        "{} suites, {cases} cases",
        report.test_suites.len()
    ))
}

/// Returns true if the name of a file is a check sum, as a study names the copies of its inputs.
pub fn is_copy(name: &str) -> bool {
    name.len() == DIGITS && name.bytes().all(|b| b.is_ascii_hexdigit())
}

/// A copy of an input: its name is its check sum.
pub fn copy(path: &Path) -> Result<String, Error> {
    regular(path)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    match sum(path)? == name {
        true => Ok("the name is the check sum".into()),
        false => Err(broken(
            path,
            "this copy was changed: its SHA-256 differs from its name".into(),
        )),
    }
}
