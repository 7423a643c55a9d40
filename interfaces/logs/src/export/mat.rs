//! MAT, version 5, compressed: a struct a table, with `t_s` (the arrival, s), `arrival_ns`, `stamp_ns` and a column
//! vector for each column; in the struct `channels` what `channels.parquet` of the run has, the estimates among it.
//! `units` and `names` have unit and name of each of them. All values are kept until the end.

use super::columns::TableColumns;
use super::failed::failed;
use super::tables::{Instants, Table};
use super::writer::{LogWriter, NewLog, RowWriter};
use crate::read::{ReadOptions, scan};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use monorig_sim::error::Error;
use monorig_sim::record::manifest::Manifest;
use monorig_sim::record::whole;
use serde_json::Value;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// File of a run with truth, estimates and commands.
const CHANNELS: &str = "channels.parquet";
/// Most characters of a name in MATLAB.
const LONGEST_NAME: usize = 63;
/// The header: 116 bytes of text, no data of objects, version 1, lowest byte first.
const TEXT: &[u8] = b"MATLAB 5.0 MAT-file, written by monorig";
const VERSION: &[u8] = b"\0\0\0\0\0\0\0\0\x00\x01IM";

/// The writer of MAT files.
pub(super) struct MatWriter;

impl LogWriter for MatWriter {
    fn name(&self) -> &'static str {
        "mat"
    }

    fn files(&self) -> &'static str {
        "One MAT file of MATLAB, with the estimates"
    }

    fn create(&self, log: NewLog<'_>) -> Result<Box<dyn RowWriter>, Error> {
        Ok(Box::new(MatFile {
            path: log.folder.join(format!("{}.mat", log.name)),
            run: log.run.to_owned(),
            tables: TableColumns::of(log.tables),
        }))
    }

    fn only_file(&self, name: &str) -> Option<String> {
        Some(format!("{name}.mat"))
    }

    fn column(&self, table: &Table, column: usize) -> String {
        let name = table.columns.get(column).map_or("", String::as_str);
        format!("{}.{name}", table.name)
    }

    fn adapt(&self, map: &mut Value, _: &str) {
        map["time"]["column"] = "arrival_ns".into();
    }
}

/// The values of all tables.
struct MatFile {
    path: PathBuf,
    run: PathBuf,
    tables: Vec<TableColumns>,
}

impl RowWriter for MatFile {
    fn row(&mut self, table: usize, at: Instants, values: &[f64]) -> Result<(), Error> {
        TableColumns::row(&mut self.tables, table, at, values);
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<u64, Error> {
        let (mut structs, mut units, mut names) = (Vec::new(), Vec::new(), Vec::new());
        let mut add = |name: &str, mut fields: Fields, columns: Vec<(String, String, Vec<f64>)>| {
            let (mut units_here, mut names_here) = (Fields::default(), Fields::default());
            for (name, unit, values) in columns {
                units_here.add(&name, characters(&unit));
                names_here.add(&name, characters(&name));
                fields.add(&name, vector(6, 9, &values, f64::to_le_bytes));
            }
            structs.push((name.to_owned(), fields.done()));
            units.push((name.to_owned(), units_here.done()));
            names.push((name.to_owned(), names_here.done()));
        };
        for all in self.tables.into_iter().filter(|t| !t.columns.is_empty()) {
            let seconds: Vec<f64> = all.arrivals_ns.iter().map(|ns| *ns as f64 / 1e9).collect();
            let mut times = Fields::default();
            times.add("t_s", vector(6, 9, &seconds, f64::to_le_bytes));
            times.add(
                "arrival_ns",
                vector(14, 12, &all.arrivals_ns, i64::to_le_bytes),
            );
            times.add("stamp_ns", vector(14, 12, &all.stamps_ns, i64::to_le_bytes));
            let units = all.table.units.iter().map(|u| (*u).to_owned());
            let columns = all.table.columns.into_iter().zip(units).zip(all.columns);
            let columns = columns.map(|((name, unit), values)| (name, unit, values));
            add(all.table.name, times, columns.collect());
        }
        if self.run.join(CHANNELS).is_file() {
            add("channels", Fields::default(), channels(&self.run)?);
        }
        for (name, of) in [("units", units), ("names", names)] {
            let mut fields = Fields::default();
            of.into_iter().for_each(|(name, of)| fields.add(&name, of));
            structs.push((name.to_owned(), fields.done()));
        }
        let path = &self.path;
        let mut file = TEXT.to_vec();
        file.resize(116, b' ');
        file.extend(VERSION);
        for (name, part) in structs {
            let variable = part.matrix(&name);
            // of the tag, whose length is a number of 32 bits; MATLAB reads no variable of 2 GB
            if variable.len() > i32::MAX as usize {
                return Err(failed(path)(&format!(
                    "`{name}` takes more than the 2 GB of a variable"
                )));
            }
            let mut zlib = ZlibEncoder::new(Vec::new(), Compression::default());
            let packed = zlib.write_all(&variable).and_then(|()| zlib.finish());
            let packed = packed.map_err(|e| failed(path)(&e))?;
            file.extend(15u32.to_le_bytes());
            file.extend((packed.len() as u32).to_le_bytes());
            file.extend(packed);
        }
        whole::write(path, &file)?;
        Ok(0)
    }
}

/// Name, unit and values of the channels of a run, the time first.
fn channels(run: &Path) -> Result<Vec<(String, String, Vec<f64>)>, Error> {
    Manifest::of_run(run)?.verify(run, CHANNELS)?;
    let (mut tables, mut times) = (Arc::default(), Vec::new());
    let mut columns: Vec<Vec<f64>> = Vec::new();
    scan(&run.join(CHANNELS), &ReadOptions::default(), &mut |chunk| {
        for row in &chunk.rows {
            times.push(row.stamp_ns as f64 * 1e-9);
            let values = chunk.values_of(row);
            columns.resize(values.len(), Vec::new());
            columns
                .iter_mut()
                .zip(values)
                .for_each(|(column, x)| column.push(*x));
        }
        tables = chunk.tables;
        true
    })?;
    let names = tables.iter().flat_map(|t| t.columns.clone());
    let all = names
        .zip(columns)
        .map(|(c, values)| (c.name, c.unit, values));
    Ok(std::iter::once(("time".to_owned(), "s".to_owned(), times))
        .chain(all)
        .collect())
}

/// A variable without its name: its class, its sizes, and what follows the name.
struct Part(u32, [usize; 2], Vec<u8>);

impl Part {
    /// As an element of this name; none of a field, which has its name in the struct.
    fn matrix(&self, name: &str) -> Vec<u8> {
        let mut inside = Vec::new();
        element(&mut inside, 6, &[self.0.to_le_bytes(), [0; 4]].concat());
        element(
            &mut inside,
            5,
            &self.1.map(|n| (n as i32).to_le_bytes()).concat(),
        );
        element(&mut inside, 1, name.as_bytes());
        inside.extend(&self.2);
        let mut all = Vec::new();
        element(&mut all, 14, &inside);
        all
    }
}

/// An element: type, length, data, and zeros up to a multiple of 8 bytes; in 8 bytes if there are few data.
fn element(out: &mut Vec<u8>, kind: u32, data: &[u8]) {
    let length = data.len() as u32;
    match length {
        1..=4 => out.extend((kind | length << 16).to_le_bytes()),
        _ => out.extend([kind.to_le_bytes(), length.to_le_bytes()].concat()),
    }
    out.extend(data);
    out.resize(out.len().next_multiple_of(8), 0);
}

/// A column vector of a class and the type of its numbers.
fn vector<T: Copy>(class: u32, kind: u32, values: &[T], bytes: fn(T) -> [u8; 8]) -> Part {
    let mut data = Vec::new();
    let all: Vec<u8> = values.iter().flat_map(|x| bytes(*x)).collect();
    element(&mut data, kind, &all);
    Part(class, [values.len(), 1], data)
}

/// A text in a row.
fn characters(text: &str) -> Part {
    let units: Vec<u16> = text.encode_utf16().collect();
    let all: Vec<u8> = units.iter().flat_map(|c| c.to_le_bytes()).collect();
    let mut data = Vec::new();
    element(&mut data, 4, &all);
    Part(4, [usize::from(!units.is_empty()), units.len()], data)
}

/// The fields of a struct.
#[derive(Default)]
struct Fields {
    names: Vec<String>,
    data: Vec<u8>,
}

impl Fields {
    /// A further field; its name is made one that MATLAB has, and that no other field has.
    fn add(&mut self, name: &str, part: Part) {
        let legal = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
        let mut word: String = name.chars().map(legal).collect();
        if !word.starts_with(|c: char| c.is_ascii_alphabetic()) {
            word.insert(0, 'x');
        }
        word.truncate(LONGEST_NAME);
        for number in 2.. {
            if !self.names.contains(&word) {
                break;
            }
            let end = format!("_{number}");
            word.truncate(LONGEST_NAME - end.len());
            word += &end;
        }
        self.names.push(word);
        self.data.extend(part.matrix(""));
    }

    /// The struct.
    fn done(self) -> Part {
        let width = LONGEST_NAME + 1;
        let mut data = Vec::new();
        element(&mut data, 5, &(width as u32).to_le_bytes());
        let mut names = Vec::new();
        for name in &self.names {
            names.extend(name.as_bytes());
            names.resize(names.len().next_multiple_of(width), 0);
        }
        element(&mut data, 1, &names);
        data.extend(self.data);
        Part(2, [1, 1], data)
    }
}
