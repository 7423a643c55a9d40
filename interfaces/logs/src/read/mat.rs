//! MAT files of MATLAB: version 5 by a reader of its own, 7.3, which is HDF5, by `hdf5-pure`. A table is the vectors
//! beside each other, at the top level or in a struct, with the vector of time among them, else with that of the struct
//! around it. A matrix with a row for each time is columns `NAME_1`, `NAME_2`. No length is trusted beyond the bytes
//! that are there.

use super::{
    Asked, LogColumn, LogReader, Out, ReadOptions, Row, arrays, full_name, text, time_column,
};
use crate::notation::Title;
use crate::{io, wrong};
use arrow_array::*;
use flate2::read::ZlibDecoder;
#[cfg(feature = "mat73")]
use hdf5_pure::{DType, Error as Hdf5Error, File, Group};
use monorig_sim::error::Error;
use std::collections::BTreeMap;
use std::io::Read;
use std::sync::Arc;

/// First bytes of a file of version 7.3.
const VERSION_7_3: &[u8] = b"MATLAB 7.3 MAT-file";
/// Most memory of all variables, bytes: a compressed file of 1 MB can hold 1 GB of zeros.
const MAX_BYTES: usize = 4 << 30;
/// Deepest struct within structs.
const MAX_DEPTH: usize = 32;
/// Describes a variable without vectors of numbers, by its class.
const CLASSES: &str = "nothing|a cell array|an array of structs|an object|text|a sparse matrix";
const BROKEN: &str = "it breaks off, is damaged or takes more than 4 GB";
const SAVED: &str = "a whole file, as `save('x.mat', '-v7')` writes it";
const HELP: &str = "vectors of one length with one called `t` or `time`, at the top level or in a struct, or `time: \
    {column: NAME, unit: s}` in the map file; a timetable `x` is `s.t = seconds(x.Time); s.v = x.v; save('x.mat', \
    '-struct', 's', '-v7')`";

/// The reader of MAT files.
pub(super) struct MatReader;

/// A vector or matrix of numbers, column by column.
struct Variable {
    name: String,
    dims: Vec<usize>,
    values: ArrayRef,
}

/// The variables of numbers by the name of the struct that they are in; what else there is; the memory taken.
#[derive(Default)]
struct Workspace {
    groups: BTreeMap<String, Vec<Variable>>,
    unread: Vec<String>,
    bytes: usize,
}

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
        let Asked { path, options, .. } = asked;
        let refused = |message: String, help: &str| Err(wrong(path, None, message, help));
        let mut found = Workspace::default();
        let bytes = std::fs::read(path).map_err(|e| io(path, e))?;
        let read = match bytes.starts_with(VERSION_7_3) {
            true => hdf5(bytes, &mut found),
            false => version_5(&bytes, &mut found).ok_or(BROKEN.to_owned()),
        };
        if let Err(why) = read {
            return refused(format!("this MAT file cannot be read: {why}"), SAVED);
        }
        let (mut tables, mut names, mut timed) = (Vec::new(), found.unread.clone(), false);
        for (group, variables) in &found.groups {
            let full = |v: &Variable| full_name(group, &v.name);
            names.extend(variables.iter().map(full));
            let Some((called, times)) = found.time_of(group, options) else {
                continue;
            };
            let (mut heads, mut columns, n) = (Vec::new(), Vec::new(), times.values.len());
            timed = true;
            for v in variables.iter().filter(|v| options.wants(group, &v.name)) {
                let width = v.values.len().checked_div(n).unwrap_or(0);
                let (column, row) = match (v.dims.first(), v.dims.last()) {
                    _ if full(v) == called => continue,
                    (Some(rows), _) if *rows == n => (n, 1),
                    (_, Some(rows)) if *rows == n => (1, width),
                    _ => {
                        let what = format!("variable {} has the sizes {:?}", full(v), v.dims);
                        if options.wanted.is_some() {
                            let message = format!("{what}, its time `{called}` has {n} values");
                            return refused(message, "a value or a row for each time");
                        }
                        out.unread(what);
                        continue;
                    }
                };
                let Some(values) = arrays::floats(v.values.as_ref()) else {
                    continue;
                };
                for k in 0..width {
                    let number = Some(format!("_{}", k + 1)).filter(|_| width > 1);
                    let name = v.name.clone() + &number.unwrap_or_default();
                    let unit = String::new();
                    heads.push(LogColumn { name, unit });
                    columns.push((values.clone(), k * column, row));
                }
            }
            if columns.is_empty() {
                continue;
            }
            let unit = time_column::unit(&Title::of(&times.name).unit);
            let unit = options.unit.or(unit);
            let unit = unit.unwrap_or_else(|| time_column::guessed_of(times.values.as_ref()));
            let stamps = time_column::stamps(times.values.as_ref(), unit).unwrap_or_default();
            if let Some(place) = stamps.iter().position(Option::is_none) {
                let message = format!("value {} of `{called}` is no time", place + 1);
                return refused(message, "a time for each row");
            }
            tables.push((out.table(group, heads), stamps, columns));
        }
        if !timed {
            let (name, names) = (options.time.as_deref().unwrap_or("t"), names.join(", "));
            let message = format!("there is no vector of times like `{name}` in: {names}");
            return refused(message, HELP);
        }
        found.unread.into_iter().for_each(|what| out.unread(what));
        // the rows of all tables in the order of their times
        let mut at = vec![0; tables.len()];
        loop {
            let heads = tables.iter().zip(&mut at);
            let heads = heads.filter_map(|(t, row)| Some((t.1.get(*row).copied()??, t, row)));
            let Some((time, (table, _, columns), row)) = heads.min_by_key(|(time, ..)| *time)
            else {
                return Ok(());
            };
            let value = |(all, first, along): &(Float64Array, usize, usize)| {
                let all = all.values();
                all.get(first + *row * along).copied().unwrap_or(f64::NAN)
            };
            let head = Row::at(*table, time, *row as u64 + 1);
            if !out.row(head, columns.iter().map(value)) {
                return Ok(());
            }
            *row += 1;
        }
    }
}

impl Workspace {
    /// Takes the memory of so many numbers.
    fn take(&mut self, numbers: usize) -> Option<()> {
        self.bytes = self
            .bytes
            .checked_add(numbers.checked_mul(8)?)?
            .min(MAX_BYTES);
        (self.bytes < MAX_BYTES).then_some(())
    }

    fn put(&mut self, group: &str, name: &str, dims: Vec<usize>, values: ArrayRef) {
        let name = name.to_owned();
        let variable = Variable { name, dims, values };
        let group = self.groups.entry(group.to_owned());
        group.or_default().push(variable);
    }

    /// The time of a struct: its own, else that of the struct around it.
    fn time_of(&self, group: &str, options: &ReadOptions) -> Option<(String, &Variable)> {
        let all = self.groups.get(group).into_iter().flatten();
        let all: Vec<_> = all.filter(|v| v.dims.contains(&v.values.len())).collect();
        let names: Vec<String> = all.iter().map(|v| v.name.clone()).collect();
        let is = |n: &String, time: &String| n == time || full_name(group, n) == *time;
        let place = match &options.time {
            Some(time) => names.iter().position(|n| is(n, time)),
            None => time_column::called(&names),
        };
        match place.and_then(|i| all.get(i)) {
            Some(time) => Some((full_name(group, &time.name), time)),
            None if group.is_empty() => None,
            None => self.time_of(group.rsplit_once('.').unwrap_or_default().0, options),
        }
    }
}

/// Reads all variables of version 5; none if the file is not whole.
fn version_5(bytes: &[u8], found: &mut Workspace) -> Option<()> {
    let mut rest = bytes.get(128..)?;
    let b"IM" = bytes.get(126..128)? else {
        return None; // the highest byte first
    };
    while !rest.is_empty() {
        let (mut kind, mut data) = element(&mut rest)?;
        let mut plain = Vec::new();
        if kind == 15 {
            let mut decoder = ZlibDecoder::new(data).take((MAX_BYTES - found.bytes) as u64);
            found.bytes += decoder.read_to_end(&mut plain).ok()?;
            (kind, data) = element(&mut plain.as_slice())?;
        }
        if kind == 14 {
            variable(data, "", None, found)?;
        }
    }
    Some(())
}

/// Type and data of the next element; none if it is not whole.
fn element<'a>(rest: &mut &'a [u8]) -> Option<(u32, &'a [u8])> {
    let first = word(rest)?;
    let (kind, begin, length) = match first >> 16 {
        0 => (first, 8, word(rest.get(4..)?)? as usize),
        length => (first & 0xFFFF, 4, length as usize), // of up to 4 bytes, in the place of their length
    };
    let data = rest.get(begin..begin + length)?;
    let whole = (begin + length).next_multiple_of(if kind == 15 { 1 } else { 8 });
    *rest = rest.get(whole..).unwrap_or_default();
    Some((kind, data))
}

fn word(bytes: &[u8]) -> Option<u32> {
    Some(u32::from_le_bytes(*bytes.first_chunk()?))
}

/// A variable, or the field of a struct, which has its name from there; none if its elements are not whole.
fn variable(
    mut data: &[u8],
    group: &str,
    field: Option<&str>,
    found: &mut Workspace,
) -> Option<()> {
    if data.is_empty() {
        return Some(()); // an empty field
    }
    let parts = &mut data;
    let flags = word(element(parts)?.1)?;
    let class = flags & 0xFF;
    let sizes = if class == 17 { &[] } else { element(parts)?.1 }; // an object has none
    let sizes = sizes.chunks(4).map(|n| word(n).map(|n| n as usize));
    let dims: Vec<usize> = sizes.collect::<Option<_>>()?;
    let own = text::of_bytes(element(parts)?.1);
    let name = field.unwrap_or(&own);
    let path = full_name(group, name);
    let count = dims.iter().try_fold(1usize, |all, n| all.checked_mul(*n))?;
    match class {
        2 if count == 1 && path.matches('.').count() < MAX_DEPTH => {
            let width = word(element(parts)?.1)?.max(1) as usize;
            for field in element(parts)?.1.chunks(width) {
                let field = text::of_bytes(field.split(|b| *b == 0).next()?);
                let (14, data) = element(parts)? else {
                    return None;
                };
                variable(data, &path, Some(&field), found)?;
            }
        }
        6..=15 if flags & 0x800 == 0 => {
            let (kind, data) = element(parts)?;
            found.take(count)?;
            let values = numbers(kind, data).filter(|v| v.len() == count)?;
            found.put(group, name, dims, values);
        }
        _ if name.is_empty() => {} // what MATLAB keeps of objects
        _ => {
            let what = CLASSES.split('|').nth(class as usize);
            let what = what.unwrap_or("an object, or complex numbers");
            found.unread.push(format!("variable {path}: {what}"));
        }
    }
    Some(())
}

/// The numbers of an element.
fn numbers(kind: u32, bytes: &[u8]) -> Option<ArrayRef> {
    let whole = |size: usize, is_signed: bool| -> ArrayRef {
        let number = move |b: &[u8]| {
            let sign = is_signed && b.last().is_some_and(|high| *high >= 0x80);
            let from_high = |all: i64, byte: &u8| all << 8 | i64::from(*byte);
            let number = b.iter().rev().fold(-i64::from(sign), from_high);
            (is_signed || number >= 0).then_some(number)
        };
        Arc::new(bytes.chunks_exact(size).map(number).collect::<Int64Array>())
    };
    let (singles, doubles) = (bytes.as_chunks().0.iter(), bytes.as_chunks().0.iter());
    Some(match kind {
        1 | 2 => whole(1, kind == 1),
        3 | 4 => whole(2, kind == 3),
        5 | 6 => whole(4, kind == 5),
        12 | 13 => whole(8, kind == 12),
        7 => Arc::new(Float32Array::from_iter_values(
            singles.map(|b| f32::from_le_bytes(*b)),
        )),
        9 => Arc::new(Float64Array::from_iter_values(
            doubles.map(|b| f64::from_le_bytes(*b)),
        )),
        _ => return None,
    })
}

#[cfg(not(feature = "mat73"))]
fn hdf5(_: Vec<u8>, _: &mut Workspace) -> Result<(), String> {
    Err("it is of version 7.3, which needs a `monorig` built with the feature `mat73`".into())
}

/// Reads all variables of version 7.3.
#[cfg(feature = "mat73")]
fn hdf5(bytes: Vec<u8>, found: &mut Workspace) -> Result<(), String> {
    let file = File::from_bytes(bytes).map_err(|e| e.to_string())?;
    hdf5_group(&file.root(), "", found).map_err(|e| e.to_string())
}

/// A group is a struct, a dataset a variable, whose sizes stand in the other order.
#[cfg(feature = "mat73")]
fn hdf5_group(at: &Group, path: &str, found: &mut Workspace) -> Result<(), Hdf5Error> {
    for name in at.datasets()? {
        let (data, full) = (at.dataset(&name)?, full_name(path, &name));
        let about = data.attrs()?;
        let class = about
            .get("MATLAB_class")
            .map_or(String::new(), |c| format!("{c:?}"));
        let dims = data.shape()?.into_iter().rev().map(|n| n as usize);
        let dims: Vec<usize> = dims.collect();
        let count = dims.iter().fold(1, |all: usize, n| all.saturating_mul(*n));
        let is_whole = class.contains("int") || class.contains("logical");
        let values: ArrayRef = match (data.dtype()?, found.take(count)) {
            _ if about.contains_key("MATLAB_empty") => continue,
            (DType::F32 | DType::F64, Some(_)) => Arc::new(Float64Array::from(data.read_f64()?)),
            (_, Some(_)) if is_whole => Arc::new(Int64Array::from(data.read_i64()?)),
            _ => {
                found
                    .unread
                    .push(format!("variable {full}: no numbers, or too many: {class}"));
                continue;
            }
        };
        found.put(path, &name, dims, values);
    }
    // `#refs#` and `#subsystem#` hold the parts of cells and objects; a damaged group may hold itself
    for name in at.groups()?.iter().filter(|name| !name.starts_with('#')) {
        if found.take(1 << 13).is_some() && path.matches('.').count() < MAX_DEPTH {
            hdf5_group(&at.group(name)?, &full_name(path, name), found)?;
        }
    }
    Ok(())
}
