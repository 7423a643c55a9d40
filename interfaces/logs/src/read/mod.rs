//! Readers of logs: one file a format, all behind the trait `LogReader`. A reader goes through its file once, in the
//! order of the file, and hands on rows in chunks; it keeps no more than a chunk, and trusts no length that the file
//! declares.
//!
//! | file | what it holds |
//! |---|---|
//! | `rows` | rows, tables, chunks: what a reader hands on |
//! | `formats` | all formats, and which of them a file is of |
//! | `csv` `parquet` `mcap` `mdf` `mat` `can` | the readers |
//! | `time_column` `text` | the column of time of a table; text that is not UTF-8 |
//! | `arrays` | columns of Arrow of any type |
//! | `plausible` | the length of a log and the largest gap in it |
//! | `merge` | rows of several files on one clock |
//! | `columns` | columns of one table as they stand in it |

mod arrays;
#[cfg(feature = "can")]
mod can;
mod columns;
mod csv;
mod formats;
mod mat;
#[cfg(feature = "mcap")]
mod mcap;
#[cfg(feature = "mdf")]
mod mdf;
pub(crate) mod merge;
mod parquet;
mod plausible;
mod reader;
mod rows;
mod text;
mod time_column;

pub use crate::notation::TimeUnit;
#[cfg(feature = "can")]
pub use can::dbc::Database;
pub use columns::{ColumnsRow, NamedColumns, WantedColumn, columns};
pub(crate) use reader::{Asked, LogReader, Section};
pub use reader::{ReadOptions, full_name};
pub(crate) use rows::Out;
pub use rows::{Chunk, LogColumn, LogTable, Row};

use monorig_sim::config::file::regular;
use monorig_sim::error::Error;
use monorig_sim::guarded::decoded;
use std::path::{Path, PathBuf};

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
        let path = &self.path;
        let asked = Asked {
            path,
            options: &self.options,
            section: self.section,
        };
        let (mut plausible, mut implausible) = (plausible::Plausible::default(), None);
        let unit_ns = self.options.unit.unwrap_or_default().of_f64(1.0);
        let period_ns = self.options.wraps.and_then(|bits| 1i64.checked_shl(bits));
        let period_ns = period_ns.and_then(|period| period.checked_mul(unit_ns?));
        let mut wraps = period_ns.map(time_column::Wraps::of);
        let mut checked = |mut chunk: Chunk| {
            if let Some(wraps) = &mut wraps {
                for row in &mut chunk.rows {
                    row.stamp_ns = wraps.unwrapped(row.stamp_ns);
                    row.arrival_ns = row.stamp_ns;
                }
            }
            match plausible.check(path, &chunk) {
                Ok(()) => sink(chunk),
                Err(e) => {
                    implausible = Some(e);
                    false
                }
            }
        };
        let mut out = Out::new(&mut checked);
        let done = self.guarded(|| self.format.read(asked, &mut out));
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
                "use a complete file; `monorig log info` shows its readable part",
            ))
        })
    }
}
