//! MAT files of MATLAB: version 5 by a reader of its own, 7.3 by `hdf5-pure`. A table is the vectors beside each other,
//! at the top level or in a struct, with the vector of time among them, else with that of the struct around it. A
//! matrix with a row for each time is columns `NAME_1`, `NAME_2`.

#[cfg(feature = "mat73")]
mod hdf5;
mod version5;
mod workspace;

use super::arrays::floats;
use super::{Asked, LogColumn, LogReader, Out, Row, full_name, time_column};
use crate::notation::Title;
use crate::{io, wrong};
use arrow_array::{Array, Float64Array};
use monorig_sim::error::Error;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::path::Path;
use workspace::{Variable, Workspace};

/// First bytes of a file of version 7.3.
const VERSION_7_3: &[u8] = b"MATLAB 7.3 MAT-file";

/// The reader of MAT files.
pub(super) struct MatReader;

impl LogReader for MatReader {
    fn name(&self) -> &'static str {
        "MAT"
    }

    fn magics(&self) -> &[&'static [u8]] {
        &[b"MATLAB 5.0 MAT-file", VERSION_7_3]
    }

    fn endings(&self) -> &[&'static str] {
        &["mat"]
    }

    fn read(&self, asked: Asked<'_>, out: &mut Out<'_>) -> Result<(), Error> {
        let path = asked.path;
        let mut found = Workspace::new(asked.options);
        let bytes = std::fs::read(path).map_err(|e| io(path, e))?;
        match bytes.starts_with(VERSION_7_3) {
            #[cfg(feature = "mat73")]
            true => hdf5::read(bytes, &mut found),
            #[cfg(not(feature = "mat73"))]
            true => Err("it is of version 7.3 (HDF5), which this program was built without".into()),
            false => version5::read(&bytes, &mut found),
        }
        .map_err(|why| {
            let message = format!("this MAT file cannot be read: {why}");
            wrong(
                path,
                None,
                message,
                "a whole file, as `save('x.mat', '-v7')` writes it",
            )
        })?;
        let mut tables = Vec::new();
        for (group, variables) in &found.groups {
            let time = found.time_of(group);
            tables.extend(table(path, &found, (group, variables), time, out)?);
        }
        for left_out in &found.unread {
            out.unread(left_out.clone());
        }
        if !found.has_time() {
            let names = found.names().join(", ");
            let what = match (names.is_empty(), &asked.options.time) {
                (true, _) => format!(
                    "no vector of numbers in it is read: {}",
                    found.unread.join("; ")
                ),
                (false, Some(time)) => {
                    format!("there is no variable `{time}` for the time; here are {names}")
                }
                (false, None) => format!("none of the variables {names} is called like a time"),
            };
            let help = "vectors of one length with one called `t` or `time`, at the top level or in a struct, or \
                        `time: {column: NAME, unit: s}` in the map file; a timetable `x` is \
                        `s.t = seconds(x.Time); s.v = x.v; save('x.mat', '-struct', 's', '-v7')`";
            return Err(wrong(path, None, what, help));
        }
        merged(&tables, out);
        Ok(())
    }
}

/// A table: its number, the times of its rows, ns, and its columns.
struct MatTable(u32, Vec<i64>, Vec<Strided>);

/// A column of a matrix: all numbers, the place of its first and the way to its next.
struct Strided(Float64Array, usize, usize);

/// The vectors of one struct as a table; none without time or columns that are wanted.
fn table(
    path: &Path,
    found: &Workspace<'_>,
    (group, variables): (&str, &[Variable]),
    time: Option<(String, &Variable)>,
    out: &mut Out<'_>,
) -> Result<Option<MatTable>, Error> {
    let (mut names, mut columns) = (Vec::new(), Vec::new());
    let rows = time.as_ref().map_or(0, |(_, t)| t.values.len());
    for variable in variables {
        let name = full_name(group, &variable.name);
        let is_time = time.as_ref().is_some_and(|(called, _)| *called == name);
        if is_time || !found.options.wants(group, &variable.name) {
            continue;
        }
        let per_row = variable.values.len().checked_div(rows).unwrap_or(0);
        let (next, along) = match (variable.dims.first(), variable.dims.last()) {
            (Some(first), _) if *first == rows => (1, rows),
            (_, Some(last)) if *last == rows => (per_row, 1),
            _ => {
                let sizes: Vec<String> = variable.dims.iter().map(usize::to_string).collect();
                let what = format!("variable {name}: {}", sizes.join("x"));
                match &time {
                    Some((called, _)) if found.options.wanted.is_some() => {
                        let message = format!("{what}, but its time `{called}` has {rows} values");
                        let help = format!(
                            "`{name}` with one value, or one row, for each value of `{called}`"
                        );
                        return Err(wrong(path, None, message, help));
                    }
                    Some(_) => out.unread(what),
                    None => out.unread(format!("{what}, without a time")),
                }
                continue;
            }
        };
        let Some(values) = floats(variable.values.as_ref()) else {
            continue;
        };
        for k in 0..per_row {
            names.push(match per_row {
                1 => variable.name.clone(),
                _ => format!("{}_{}", variable.name, k + 1),
            });
            columns.push(Strided(values.clone(), k * along, next));
        }
    }
    let Some((called, times)) = time.filter(|_| !columns.is_empty()) else {
        return Ok(None);
    };
    let unit = found
        .options
        .unit
        .or_else(|| time_column::unit(&Title::of(&times.name).unit));
    let unit = unit.unwrap_or_else(|| time_column::guessed_of(times.values.as_ref()));
    let stamps = time_column::stamps(times.values.as_ref(), unit).unwrap_or_default();
    if let Some(place) = stamps.iter().position(Option::is_none) {
        let message = format!("value {} of `{called}` is no time", place + 1);
        return Err(wrong(path, None, message, "a time for each row"));
    }
    let columns_of = names.into_iter().map(|name| LogColumn {
        name,
        unit: String::new(),
    });
    let number = out.table(group, columns_of.collect());
    Ok(Some(MatTable(
        number,
        stamps.into_iter().flatten().collect(),
        columns,
    )))
}

/// Hands on the rows of all tables in the order of their times.
fn merged(tables: &[MatTable], out: &mut Out<'_>) {
    let next = |(number, row): (usize, usize)| {
        let time = tables.get(number)?.1.get(row)?;
        Some(Reverse((*time, number, row)))
    };
    let mut heads: BinaryHeap<_> = (0..tables.len()).filter_map(|n| next((n, 0))).collect();
    while let Some(Reverse((time, number, row))) = heads.pop() {
        let Some(MatTable(table, _, columns)) = tables.get(number) else {
            continue;
        };
        let value = |Strided(all, first, next): &Strided| {
            let place = first + row * next;
            if place < all.len() {
                all.value(place)
            } else {
                f64::NAN
            }
        };
        if !out.row(
            Row::at(*table, time, row as u64 + 1),
            columns.iter().map(value),
        ) {
            return;
        }
        heads.extend(next((number, row + 1)));
    }
}
