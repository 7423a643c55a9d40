//! The functions of a format for reading logs, and their options.

use super::rows::Out;
use crate::notation::TimeUnit;
use monorig_sim::error::Error;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Options of reading a file.
#[derive(Clone, Debug, Default)]
pub struct ReadOptions {
    /// Column of the time, of tables of text and of Parquet; without it one that is called like a time.
    pub time: Option<String>,
    /// Unit of that column; without it by the column's name or type, else seconds.
    pub unit: Option<TimeUnit>,
    /// Number of bits after which the counter of the column wraps; `None` if it does not wrap.
    pub wraps: Option<u32>,
    /// Column of text (CSV) whose change begins a new piece of the log, in which time begins again.
    pub pieces: Option<String>,
    /// Wanted columns, as `column` or `table.column`; `None` = all.
    pub wanted: Option<BTreeSet<String>>,
    /// Database of the messages of a CAN log.
    pub dbc: Option<PathBuf>,
}

impl ReadOptions {
    /// True if this column of this table is wanted.
    pub(crate) fn wants(&self, table: &str, column: &str) -> bool {
        self.wanted.as_ref().is_none_or(|wanted| {
            wanted.contains(column) || wanted.contains(&full_name(table, column))
        })
    }
}

/// `table.column`, or the column alone in a file of one table.
pub fn full_name(table: &str, column: &str) -> String {
    match table {
        "" => column.to_owned(),
        _ => format!("{table}.{column}"),
    }
}

/// The tables of a file that are read together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Section {
    /// All of them.
    Whole,
    /// One of several groups, by the numbers that the reader gave it.
    #[cfg_attr(not(feature = "mdf"), allow(dead_code))]
    Group(usize, usize),
}

/// The part of a file that is asked for.
#[derive(Clone, Copy)]
pub(crate) struct Asked<'a> {
    /// The file.
    pub path: &'a Path,
    pub options: &'a ReadOptions,
    pub section: Section,
}

/// Reads logs of one format. A further format is a file with an `impl` of this trait, and a line in `formats.rs`.
pub(crate) trait LogReader: Sync {
    /// The name of the format, for messages.
    fn name(&self) -> &'static str;

    /// The first bytes of its files: any of these. They count more than the ending of the file's name.
    fn magics(&self) -> &[&'static [u8]] {
        &[]
    }

    /// Endings of file names, in lower case, with which a file must begin with one of the magics.
    fn endings(&self) -> &[&'static str] {
        &[]
    }

    /// True if a file without a magic is of this format, by its first bytes and its ending in lower case.
    fn recognises(&self, _head: &[u8], _ending: &str) -> bool {
        false
    }

    /// True if it holds CAN frames, which a database of messages makes values of.
    fn is_can(&self) -> bool {
        false
    }

    /// True if the rows of a section stand in the order of their time.
    fn is_in_order(&self) -> bool {
        !self.is_can()
    }

    /// True if the columns of a file are known before it is read to its end.
    fn declares_columns(&self) -> bool {
        true
    }

    /// The cargo feature that this program was built without, of a format that it cannot read.
    fn missing_feature(&self) -> Option<&'static str> {
        None
    }

    /// The sections of a file that can be read side by side, each in the order of its own time; none if nothing in it
    /// is wanted.
    fn sections(&self, _path: &Path, _options: &ReadOptions) -> Result<Vec<Section>, Error> {
        Ok(vec![Section::Whole])
    }

    /// Reads a section of a file. Errors name the file and the place in it.
    fn read(&self, asked: Asked<'_>, out: &mut Out<'_>) -> Result<(), Error>;
}
