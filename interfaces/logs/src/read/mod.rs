//! Readers of logs: one file a format, all behind the trait `LogReader`. A reader goes through its file once, in the
//! order of the file, and hands on rows in chunks; it keeps no more than a chunk, and trusts no length that the file
//! declares.
//!
//! | file | what it holds |
//! |---|---|
//! | `rows` | rows, tables, chunks: what a reader hands on |
//! | `formats` | all formats, and which of them a file is of |
//! | `csv` `parquet` `mcap` `mdf` `can` | the readers |
//! | `time_column` `text` | the column of time of a table; text that is not UTF-8 |
//! | `arrays` | columns of Arrow of any type |
//! | `plausible` | the length of a log and the largest gap in it |
//! | `merge` | rows of several files on one clock |

mod arrays;
#[cfg(feature = "can")]
mod can;
mod csv;
mod formats;
#[cfg(feature = "mcap")]
mod mcap;
#[cfg(feature = "mdf")]
mod mdf;
pub(crate) mod merge;
mod parquet;
mod plausible;
mod rows;
mod text;
mod time_column;

pub use crate::notation::TimeUnit;
#[cfg(feature = "can")]
pub use can::dbc::Database;
pub(crate) use rows::Out;
pub use rows::{Chunk, LogColumn, LogTable, Row};

use monorig_sim::config::file::regular;
use monorig_sim::error::Error;
use monorig_sim::guarded::decoded;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Options of reading a file.
#[derive(Clone, Debug, Default)]
pub struct ReadOptions {
    /// Column of the time, of tables of text and of Parquet; without it one that is called like a time.
    pub time: Option<String>,
    /// Unit of that column; without it by the column's name or type, else seconds.
    pub unit: Option<TimeUnit>,
    /// Column of text (CSV) whose change begins a new piece of the log, in which time begins anew.
    pub pieces: Option<String>,
    /// Columns that are wanted, as `column` or `table.column`; without it all.
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
        true
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
    fn read(
        &self,
        path: &Path,
        options: &ReadOptions,
        section: Section,
        out: &mut Out<'_>,
    ) -> Result<(), Error>;
}

/// Reads a whole file, chunk by chunk, until its end or until `sink` returns false. Errors name the file and the place
/// in it; decoders of other libraries that panic are errors.
pub fn scan(
    path: &Path,
    options: &ReadOptions,
    sink: &mut dyn FnMut(Chunk) -> bool,
) -> Result<(), Error> {
    Part::whole(path, options)?.scan(sink)
}

/// A part of a file that is read in the order of its own time.
pub(crate) struct Part {
    pub path: PathBuf,
    pub format: &'static dyn LogReader,
    options: ReadOptions,
    section: Section,
}

impl Part {
    /// A file as a whole: where its sections are read side by side by others, here one after the other.
    pub fn whole(path: &Path, options: &ReadOptions) -> Result<Self, Error> {
        regular(path)?;
        Ok(Self {
            path: path.to_owned(),
            format: formats::reader_of(path)?,
            options: options.clone(),
            section: Section::Whole,
        })
    }

    /// The parts of a file that can be read side by side.
    pub fn all(path: &Path, options: &ReadOptions) -> Result<Vec<Self>, Error> {
        let whole = Self::whole(path, options)?;
        let sections = whole.guarded(|| whole.format.sections(path, options))?;
        let part = |section| Self {
            path: path.to_owned(),
            format: whole.format,
            options: options.clone(),
            section,
        };
        Ok(sections.into_iter().map(part).collect())
    }

    /// Reads it, chunk by chunk, until its end or until `sink` returns false.
    pub fn scan(&self, sink: &mut dyn FnMut(Chunk) -> bool) -> Result<(), Error> {
        let Self {
            path,
            options,
            section,
            ..
        } = self;
        let (mut plausible, mut implausible) = (plausible::Plausible::default(), None);
        let mut checked = |chunk: Chunk| match plausible.check(path, &chunk) {
            Ok(()) => sink(chunk),
            Err(e) => {
                implausible = Some(e);
                false
            }
        };
        let mut out = Out::new(&mut checked);
        let done = self.guarded(|| self.format.read(path, options, *section, &mut out));
        out.flush();
        match implausible {
            Some(e) => Err(e),
            None => done,
        }
    }

    /// Runs a decoder: a panic of it is an error of the file.
    fn guarded<T>(&self, decode: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
        decoded(decode).unwrap_or_else(|what| {
            Err(crate::wrong(
                &self.path,
                None,
                format!("this {} file cannot be read: {what}", self.format.name()),
                "a file that is whole; see what `monorig inspect` reads of it",
            ))
        })
    }
}
