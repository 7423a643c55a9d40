//! The column of time of a table.

use super::ReadOptions;
use crate::notation::TimeUnit;
use crate::wrong;
use monorig_sim::error::Error;
use std::path::Path;

/// Names that a column of time may have, and the unit it then has.
const TIMES: &[(&str, TimeUnit)] = &[
    ("t", TimeUnit::Seconds),
    ("time", TimeUnit::Seconds),
    ("t_s", TimeUnit::Seconds),
    ("time_s", TimeUnit::Seconds),
    ("timestamp", TimeUnit::Seconds),
    ("timestamps", TimeUnit::Seconds),
    ("t_ms", TimeUnit::Milliseconds),
    ("time_ms", TimeUnit::Milliseconds),
    ("timestamp_ms", TimeUnit::Milliseconds),
    ("t_us", TimeUnit::Microseconds),
    ("time_us", TimeUnit::Microseconds),
    ("timestamp_us", TimeUnit::Microseconds),
    ("t_ns", TimeUnit::Nanoseconds),
    ("time_ns", TimeUnit::Nanoseconds),
    ("timestamp_ns", TimeUnit::Nanoseconds),
];

/// The column of time among these names, and its unit: the one asked for, else the first that is called like a time.
pub(super) fn find(
    file: &Path,
    names: &[String],
    options: &ReadOptions,
) -> Result<(usize, TimeUnit), Error> {
    let all = || names.join(", ");
    let by_name = |name: &str| {
        TIMES
            .iter()
            .find(|(t, _)| name.eq_ignore_ascii_case(t))
            .map(|t| t.1)
    };
    let column = match &options.time {
        Some(name) => names.iter().position(|n| n == name).ok_or_else(|| {
            wrong(
                file,
                Some(1),
                format!("there is no column `{name}` for the time"),
                format!("columns here: {}", all()),
            )
        })?,
        None => names
            .iter()
            .position(|n| by_name(n).is_some())
            .ok_or_else(|| {
                wrong(
                    file,
                    Some(1),
                    format!("none of the columns {} is called like a time", all()),
                    "`time: {column: NAME, unit: s}` in the map file",
                )
            })?,
    };
    let named = names.get(column).and_then(|n| by_name(n));
    Ok((column, options.unit.or(named).unwrap_or_default()))
}
