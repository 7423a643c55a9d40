//! MAT, version 5, compressed: a struct a table, with `t_s` (the arrival, s), `arrival_ns`, `stamp_ns` and a column
//! vector for each column; in the struct `channels` what `channels.parquet` of the run has, the estimates among it.
//! `units` and `names` have unit and name of each of them. All values are kept until the end.

use super::columns::TableColumns;
use super::failed::failed;
use super::tables::Instants;
use super::writer::{LogWriter, NewLog, RowWriter};
use crate::read::{ReadOptions, scan};
use flate2::{Compression, write::ZlibEncoder};
use monorig_sim::error::Error;
use monorig_sim::record::{manifest::Manifest, whole};
use serde_json::Value;
use std::io::Write;
use std::path::{Path, PathBuf};

/// File of a run with truth, estimates and commands.
const CHANNELS: &str = "channels.parquet";
/// Most characters of a name in MATLAB.
const LONGEST_NAME: usize = 63;
/// The header: text, no data of objects, version 1, lowest byte first.
const TEXT: &str = "MATLAB 5.0 MAT-file, written by monorig";
const VERSION: &[u8; 12] = b"\0\0\0\0\0\0\0\0\x00\x01IM";

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
        let path = log.folder.join(format!("{}.mat", log.name));
        let tables = TableColumns::of(log.tables);
        Ok(Box::new(MatFile(path, log.run.to_owned(), tables)))
    }

    fn only_file(&self, name: &str) -> Option<String> {
        Some(format!("{name}.mat"))
    }

    fn adapt(&self, map: &mut Value, _: &str) {
        map["time"]["column"] = "arrival_ns".into();
    }
}

/// The place of the file, the folder of the run, and the values of all tables.
struct MatFile(PathBuf, PathBuf, Vec<TableColumns>);

/// Name, unit and values of a column.
type MatColumn = (String, String, Vec<f64>);

impl RowWriter for MatFile {
    fn row(&mut self, table: usize, at: Instants, values: &[f64]) -> Result<(), Error> {
        TableColumns::row(&mut self.2, table, at, values);
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<u64, Error> {
        let Self(path, run, tables) = *self;
        let mut file = [format!("{TEXT:116}").as_bytes(), VERSION].concat();
        let (mut units, mut names) = (StructFields::default(), StructFields::default());
        let mut add = |table: &str, mut fields: StructFields, columns: Vec<MatColumn>| {
            let (mut units_here, mut names_here) =
                (StructFields::default(), StructFields::default());
            for (name, unit, values) in columns {
                units_here.text(&name, &unit);
                names_here.text(&name, &name);
                fields.vector(&name, (6, 9), values.iter().map(|x| x.to_le_bytes()));
            }
            units.add(table, |name| units_here.made(name));
            names.add(table, |name| names_here.made(name));
            variable(&mut file, fields.made(table)).map_err(|e| failed(&path)(&e))
        };
        for all in tables.into_iter().filter(|t| !t.columns.is_empty()) {
            let seconds = all.arrivals_ns.iter().map(|ns| *ns as f64 / 1e9);
            let mut times = StructFields::default();
            times.vector("t_s", (6, 9), seconds.map(f64::to_le_bytes));
            for (name, ns) in [("arrival_ns", all.arrivals_ns), ("stamp_ns", all.stamps_ns)] {
                times.vector(name, (14, 12), ns.into_iter().map(i64::to_le_bytes));
            }
            let units = all.table.units.iter().map(|u| (*u).to_owned());
            let columns = all.table.columns.into_iter().zip(units).zip(all.columns);
            let columns = columns.map(|((name, unit), values)| (name, unit, values));
            add(all.table.name, times, columns.collect())?;
        }
        if run.join(CHANNELS).is_file() {
            add("channels", StructFields::default(), channels(&run)?)?;
        }
        for (name, all) in [("units", units), ("names", names)] {
            variable(&mut file, all.made(name)).map_err(|e| failed(&path)(&e))?;
        }
        whole::write(&path, &file)?;
        Ok(0)
    }
}

/// The channels of a run, the time first.
fn channels(run: &Path) -> Result<Vec<MatColumn>, Error> {
    Manifest::of_run(run)?.verify(run, CHANNELS)?;
    let mut all = vec![("time".to_owned(), "s".to_owned(), Vec::new())];
    scan(&run.join(CHANNELS), &ReadOptions::default(), &mut |chunk| {
        for column in chunk
            .tables
            .iter()
            .flat_map(|t| &t.columns)
            .skip(all.len() - 1)
        {
            all.push((column.name.clone(), column.unit.clone(), Vec::new()));
        }
        for row in &chunk.rows {
            let time = row.stamp_ns as f64 * 1e-9;
            let values = std::iter::once(&time).chain(chunk.values_of(row));
            all.iter_mut()
                .zip(values)
                .for_each(|((.., column), x)| column.push(*x));
        }
        true
    })?;
    Ok(all)
}

/// A compressed variable behind the others. MATLAB reads none of 2 GB.
fn variable(file: &mut Vec<u8>, variable: Vec<u8>) -> std::io::Result<()> {
    if variable.len() > i32::MAX as usize {
        return Err(std::io::Error::other(
            "a variable takes more than 2 GB: choose another format",
        ));
    }
    let mut zlib = ZlibEncoder::new(Vec::new(), Compression::default());
    zlib.write_all(&variable)?;
    let packed = zlib.finish()?;
    file.extend([15u32.to_le_bytes(), (packed.len() as u32).to_le_bytes()].concat());
    file.extend(packed);
    Ok(())
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

/// A variable of a class and sizes, and what follows its name.
fn matrix(name: &str, class: u32, sizes: [usize; 2], rest: &[u8]) -> Vec<u8> {
    let (mut inside, mut all) = (Vec::new(), Vec::new());
    element(&mut inside, 6, &[class.to_le_bytes(), [0; 4]].concat());
    element(
        &mut inside,
        5,
        &sizes.map(|n| (n as u32).to_le_bytes()).concat(),
    );
    element(&mut inside, 1, name.as_bytes());
    inside.extend(rest);
    element(&mut all, 14, &inside);
    all
}

/// The fields of a struct.
#[derive(Default)]
struct StructFields {
    names: Vec<String>,
    data: Vec<u8>,
}

impl StructFields {
    /// A further field; its name is made one that MATLAB has, and that no other field has.
    fn add(&mut self, name: &str, field: impl FnOnce(&str) -> Vec<u8>) {
        let legal = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
        let mut word: String = name.chars().map(legal).take(LONGEST_NAME - 6).collect();
        if !word.starts_with(|c: char| c.is_ascii_alphabetic()) {
            word.insert(0, 'x');
        }
        if self.names.contains(&word) {
            word += &format!("_{}", self.names.len());
        }
        self.names.push(word);
        self.data.extend(field(""));
    }

    /// A column vector; the class and the type of its numbers.
    fn vector(
        &mut self,
        name: &str,
        (class, kind): (u32, u32),
        all: impl Iterator<Item = [u8; 8]>,
    ) {
        let mut data = Vec::new();
        let all: Vec<u8> = all.flatten().collect();
        element(&mut data, kind, &all);
        self.add(name, |name| matrix(name, class, [all.len() / 8, 1], &data));
    }

    /// A text in a row.
    fn text(&mut self, name: &str, text: &str) {
        let (mut data, length) = (Vec::new(), text.encode_utf16().count());
        element(&mut data, 16, text.as_bytes());
        self.add(name, |name| matrix(name, 4, [1, length], &data));
    }

    /// The struct.
    fn made(self, name: &str) -> Vec<u8> {
        let (mut data, mut names) = (Vec::new(), Vec::new());
        for name in &self.names {
            names.extend(name.as_bytes());
            names.resize(names.len().next_multiple_of(LONGEST_NAME + 1), 0);
        }
        element(&mut data, 5, &(LONGEST_NAME as u32 + 1).to_le_bytes());
        element(&mut data, 1, &names);
        matrix(name, 2, [1, 1], &[data, self.data].concat())
    }
}
