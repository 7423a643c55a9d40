//! CSV: names in the first line; comma, semicolon or tab between values; decimal point, or comma where values are not separated by one;
//! UTF-8 with or without byte order mark, or Latin-1. Empty, `nan` and `null` stand for no value. Lines that begin with `#` are comments.

use super::{Column, Out, ReadOptions, Row};
use crate::notation::TimeUnit;
use crate::{io, wrong};
use monorig_sim::error::{Error, InputError};
use std::borrow::Cow;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// Longest first line.
const MAX_HEADER: u64 = 1 << 20;

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
pub(super) fn time_column(
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

/// Bytes as text: UTF-8, else each byte a character of Latin-1.
pub(super) fn text(bytes: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(bytes) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => Cow::Owned(bytes.iter().map(|b| *b as char).collect()),
    }
}

/// The name and the unit of a title such as `Speed [km/h]` or `ax (m/s²)`; the name is the whole title, as the map file writes it.
fn titled(title: &str) -> Column {
    let unit = title
        .strip_suffix(']')
        .and_then(|t| t.rsplit_once('['))
        .or_else(|| title.strip_suffix(')').and_then(|t| t.rsplit_once('(')));
    Column {
        name: title.to_owned(),
        unit: unit.map_or(String::new(), |u| u.1.trim().to_owned()),
    }
}

/// Reads a file.
pub(super) fn read(path: &Path, options: &ReadOptions, out: &mut Out<'_>) -> Result<(), Error> {
    let mut file = File::open(path).map_err(|e| io(path, e))?;
    let delimiter = prepare(path, &mut file)?;
    let comma = delimiter != b',';
    let mut reader = ::csv::ReaderBuilder::new()
        .delimiter(delimiter)
        .comment(Some(b'#'))
        .trim(::csv::Trim::All)
        .from_reader(BufReader::with_capacity(1 << 16, file));
    let broken = |e: ::csv::Error| {
        let line = e.position().map(|p| p.line() as usize);
        match e.kind() {
            ::csv::ErrorKind::UnequalLengths {
                expected_len, len, ..
            } => wrong(
                path,
                line,
                format!("this line has {len} values, the first line {expected_len} names"),
                "as many values as names; a line that breaks off is removed",
            ),
            _ => wrong(
                path,
                line,
                format!("this line cannot be read: {e}"),
                "a table of text, a row a line",
            ),
        }
    };
    let names: Vec<String> = reader
        .byte_headers()
        .map_err(broken)?
        .iter()
        .map(|n| text(n).into_owned())
        .collect();
    if let Some((i, name)) = names
        .iter()
        .enumerate()
        .find(|(i, n)| names.iter().take(*i).any(|m| m == *n))
    {
        return Err(wrong(
            path,
            Some(1),
            format!("the column `{name}` is there twice (column {})", i + 1),
            "a name for each column",
        ));
    }
    let (time, unit) = time_column(path, &names, options)?;
    let pieces = match &options.pieces {
        None => None,
        Some(name) => Some(names.iter().position(|n| n == name).ok_or_else(|| {
            wrong(
                path,
                Some(1),
                format!("there is no column `{name}` for the pieces"),
                format!("columns here: {}", names.join(", ")),
            )
        })?),
    };
    let wanted: Vec<usize> = (0..names.len())
        .filter(|i| {
            *i != time && Some(*i) != pieces && names.get(*i).is_some_and(|n| options.wants("", n))
        })
        .collect();
    let columns = wanted
        .iter()
        .filter_map(|i| names.get(*i))
        .map(|n| titled(n))
        .collect();
    let table = out.table("", columns);

    let strict = options.wanted.is_some();
    let mut record = ::csv::ByteRecord::new();
    let mut values = Vec::with_capacity(wanted.len());
    let mut piece = (Vec::new(), 0u32);
    let mut first = true;
    while reader.read_byte_record(&mut record).map_err(broken)? {
        let line = record.position().map_or(0, ::csv::Position::line);
        let at = |column: usize, message: String, help: &str| -> Error {
            InputError {
                file: path.into(),
                line: Some(line as usize),
                column: Some(
                    1 + record
                        .iter()
                        .take(column)
                        .map(|f| text(f).chars().count() + 1)
                        .sum::<usize>(),
                ),
                key: String::new(),
                message,
                help: help.into(),
            }
            .into()
        };
        let stamp = text(record.get(time).unwrap_or_default());
        let stamp = if comma {
            Cow::Owned(stamp.replace(',', "."))
        } else {
            stamp
        };
        let Some(stamp_ns) = unit.parse(&stamp) else {
            let name = names.get(time).map_or("", String::as_str);
            return Err(at(
                time,
                format!("`{stamp}` in the column `{name}` is no time"),
                "a number in the unit of the column, or `unit: iso8601` for dates",
            ));
        };
        if let Some(column) = pieces {
            let name = record.get(column).unwrap_or_default();
            if !first && piece.0 != name {
                piece.1 += 1;
            }
            if piece.0 != name {
                piece.0 = name.to_vec();
            }
        }
        first = false;
        values.clear();
        for &column in &wanted {
            let word = record.get(column).unwrap_or_default();
            match number(word, comma) {
                Some(x) => values.push(x),
                None if strict => {
                    let name = names.get(column).map_or("", String::as_str);
                    return Err(at(
                        column,
                        format!("`{}` in the column `{name}` is no number", text(word)),
                        "a number; empty where there is none",
                    ));
                }
                None => values.push(f64::NAN),
            }
        }
        let row = Row {
            table,
            piece: piece.1,
            stamp_ns,
            arrival_ns: stamp_ns,
            place: line,
            first: 0,
        };
        if !out.row(row, values.iter().copied()) {
            return Ok(());
        }
    }
    Ok(())
}

/// A number; not a number where the field says that there is none.
fn number(word: &[u8], comma: bool) -> Option<f64> {
    let word = std::str::from_utf8(word).ok()?;
    if word.is_empty()
        || ["nan", "null", "na", "n/a"]
            .iter()
            .any(|n| word.eq_ignore_ascii_case(n))
    {
        return Some(f64::NAN);
    }
    let x: f64 = match comma && word.contains(',') {
        true => word.replace(',', ".").parse().ok()?,
        false => word.parse().ok()?,
    };
    x.is_finite().then_some(x)
}

/// Skips a byte order mark, and finds what separates the values: of semicolon, tab and comma the one that is most often in the first line.
fn prepare(path: &Path, file: &mut File) -> Result<u8, Error> {
    let mut mark = [0u8; 3];
    let bom = file.read_exact(&mut mark).is_ok() && mark == [0xEF, 0xBB, 0xBF];
    let start = if bom { 3 } else { 0 };
    let mut line = Vec::new();
    file.seek(SeekFrom::Start(start)).map_err(|e| io(path, e))?;
    let mut reader = BufReader::new(file.take(MAX_HEADER));
    while line.is_empty() || line.starts_with(b"#") {
        line.clear();
        if reader
            .read_until(b'\n', &mut line)
            .map_err(|e| io(path, e))?
            == 0
        {
            break;
        }
    }
    drop(reader);
    file.seek(SeekFrom::Start(start)).map_err(|e| io(path, e))?;
    if line.len() as u64 >= MAX_HEADER {
        return Err(wrong(
            path,
            Some(1),
            "the first line is longer than 1 MB",
            "names of columns in the first line",
        ));
    }
    let count = |mark: &u8| line.iter().filter(|b| *b == mark).count();
    Ok([b',', b'\t', b';']
        .into_iter()
        .max_by_key(count)
        .unwrap_or(b','))
}
