//! The column of time of a table.

use super::ReadOptions;
use super::arrays::{floats, integers, words};
use crate::notation::{TimeUnit, Title};
use crate::wrong;
use arrow_array::Array;
use arrow_schema::{DataType, TimeUnit as ArrowUnit};
use monorig_sim::error::Error;
use std::path::Path;

/// Names of a column of time, without their unit; of several columns the first name of this list.
const TIMES: &str = "t|time|timestamp|timestamps|time stamp|stamp|zeit|zeitstempel|seconds elapsed|elapsed|\
    elapsed time|time elapsed|datetime|date time|datum uhrzeit|device time|system time|utc time|utc|unix time|\
    epoch|gps time|uhrzeit|x value";

/// The column of time among these names, and its unit where the options or the name tell it: the column asked for, else
/// the one that is called most like a time.
pub(super) fn find(
    file: &Path,
    names: &[String],
    options: &ReadOptions,
) -> Result<(usize, Option<TimeUnit>), Error> {
    let all = || names.join(", ");
    let column = match &options.time {
        Some(name) => names.iter().position(|n| n == name).ok_or_else(|| {
            wrong(
                file,
                Some(1),
                format!("the file has no column `{name}` for the time"),
                format!("columns here: {}", all()),
            )
        })?,
        None => called(names).ok_or_else(|| {
            wrong(
                file,
                Some(1),
                format!("none of the columns {} has the name of a time", all()),
                "set `time: {column: NAME, unit: s}` in the map file",
            )
        })?,
    };
    let named = names.get(column).and_then(|n| unit(&Title::of(n).unit));
    Ok((column, options.unit.or(named)))
}

/// The column whose name is most similar to a time.
pub(super) fn called(names: &[String]) -> Option<usize> {
    TIMES.split('|').find_map(|time| {
        let is = |title: &String| Title::of(title).words.join(" ") == time;
        names.iter().position(is)
    })
}

/// The unit of a time as a title or a row of units writes it.
pub(super) fn unit(word: &str) -> Option<TimeUnit> {
    Some(match word.trim_matches(['[', ']', '(', ')']) {
        "s" | "sec" | "seconds" => TimeUnit::Seconds,
        "ms" => TimeUnit::Milliseconds,
        "us" | "µs" => TimeUnit::Microseconds,
        "ns" => TimeUnit::Nanoseconds,
        _ => return None,
    })
}

/// The unit of times of which only the first is known: a date, or a number, which since 1970 has a size by its unit.
pub(super) fn guessed(first: &str) -> TimeUnit {
    let first = first.trim();
    match first.parse::<f64>().map(f64::abs) {
        Ok(x) if x >= 1e17 => TimeUnit::Nanoseconds,
        Ok(x) if x >= 1e14 => TimeUnit::Microseconds,
        Ok(x) if x >= 1e11 => TimeUnit::Milliseconds,
        Err(_) if TimeUnit::Iso8601.parse(first).is_some() => TimeUnit::Iso8601,
        _ => TimeUnit::Seconds,
    }
}

/// The unit of a column of Arrow by its first value.
pub(super) fn guessed_of(times: &dyn Array) -> TimeUnit {
    let first = match words(times) {
        Some(words) => words.into_iter().flatten().next().map(str::to_owned),
        None => floats(times).and_then(|x| Some(x.iter().flatten().next()?.to_string())),
    };
    first.map_or(TimeUnit::Seconds, |first| guessed(&first))
}

/// The stamps of a column of Arrow, ns.
pub(super) fn stamps(column: &dyn Array, unit: TimeUnit) -> Result<Vec<Option<i64>>, String> {
    let kind = column.data_type();
    let per_unit = match kind {
        DataType::Timestamp(u, _) | DataType::Duration(u) => Some(match u {
            ArrowUnit::Second => 1_000_000_000,
            ArrowUnit::Millisecond => 1_000_000,
            ArrowUnit::Microsecond => 1_000,
            ArrowUnit::Nanosecond => 1,
        }),
        _ => None,
    };
    let of_integer = |x: i64| match per_unit {
        Some(per_unit) => x.checked_mul(per_unit),
        None => unit.of_i64(x),
    };
    if let Some(integers) = integers(column) {
        return Ok(integers.iter().map(|x| of_integer(x?)).collect());
    }
    if let Some(words) = words(column) {
        return Ok(words.into_iter().map(|x| unit.parse(x?)).collect());
    }
    match floats(column).filter(|_| kind.is_floating()) {
        Some(floats) => Ok(floats.iter().map(|x| unit.of_f64(x?)).collect()),
        None => Err(format!("its time column has the type {kind}")),
    }
}

/// A time that wraps after a period.
pub(super) struct Wraps {
    period_ns: i64,
    last_ns: Option<i64>,
    passed_ns: i64,
}

impl Wraps {
    /// Period, ns.
    pub fn of(period_ns: i64) -> Self {
        Self {
            period_ns,
            last_ns: None,
            passed_ns: 0,
        }
    }

    /// The continued time; a step back by more than half a period counts as a wrap.
    pub fn unwrapped(&mut self, ns: i64) -> i64 {
        let last = self.last_ns.replace(ns).unwrap_or(ns);
        let anew = last.saturating_sub(ns) > self.period_ns / 2;
        self.passed_ns += if anew { self.period_ns } else { 0 };
        ns.saturating_add(self.passed_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_in_the_ways_of_loggers() {
        let column = |names: &[&str]| {
            let names: Vec<String> = names.iter().map(|n| (*n).to_owned()).collect();
            find(Path::new("a.csv"), &names, &ReadOptions::default())
        };
        for (names, place, unit) in [
            (&["v", "t"][..], 1, None),
            (&["time", "seconds_elapsed", "z"], 0, None),
            (&["Zeit [s]", "v"], 0, Some(TimeUnit::Seconds)),
            (&["v", "time_ms"], 1, Some(TimeUnit::Milliseconds)),
            (&["timestamp_ns"], 0, Some(TimeUnit::Nanoseconds)),
            (&["%time", "field.header.stamp"], 0, None),
            (&["GPS Time", "Device Time"], 1, None),
            (&["TIMESTAMP", "v"], 0, None),
        ] {
            assert_eq!(column(names).unwrap(), (place, unit), "{names:?}");
        }
        assert!(column(&["uptime_of_what", "v"]).is_err());
        for (first, unit) in [
            ("0.01", TimeUnit::Seconds),
            ("1700000000.5", TimeUnit::Seconds),
            ("1700000000123", TimeUnit::Milliseconds),
            ("1700000000123456", TimeUnit::Microseconds),
            ("1700000000123456789", TimeUnit::Nanoseconds),
            ("2023-11-14T22:13:20+02:00", TimeUnit::Iso8601),
            ("14.11.2023 22:13:20", TimeUnit::Iso8601),
            ("what", TimeUnit::Seconds),
        ] {
            assert_eq!(guessed(first), unit, "{first}");
        }
    }
}
