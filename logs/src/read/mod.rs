//! Readers: one file a format. A reader goes through its file once, in the order of the file, and hands on rows in chunks; it keeps no more
//! than a chunk, and trusts no length that the file declares.

mod can;
mod csv;
mod format;
mod mcap;
mod mdf;
pub(crate) mod merge;
mod parquet;
mod rows;

pub use crate::notation::TimeUnit;
pub use can::dbc;
pub use format::Format;
pub use rows::{Chunk, Column, Out, Row, Table};

use monorig_sim::config::file::regular;
use monorig_sim::error::Error;
use monorig_sim::record::decoder::guarded;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// What is to be read of a file, and how.
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
    /// Whether this column of this table is wanted.
    pub fn wants(&self, table: &str, column: &str) -> bool {
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

/// Reads a whole file, chunk by chunk, until there is no more or `sink` wants none. Errors name the file and the place in it; decoders of
/// other libraries that panic are errors.
pub fn scan(
    path: &Path,
    options: &ReadOptions,
    sink: &mut dyn FnMut(Chunk) -> bool,
) -> Result<(), Error> {
    regular(path)?;
    let format = Format::of(path)?;
    scan_as(format, path, options, sink)
}

/// The same with the format known. For MDF, whose channel groups are tables of their own, all groups one after the other.
pub fn scan_as(
    format: Format,
    path: &Path,
    options: &ReadOptions,
    sink: &mut dyn FnMut(Chunk) -> bool,
) -> Result<(), Error> {
    let mut out = Out::new(sink);
    let read = || match format {
        Format::Csv => csv::read(path, options, &mut out),
        Format::Parquet => parquet::read(path, options, &mut out),
        Format::Mcap => mcap::read(path, options, &mut out),
        Format::Mdf => mdf::read(path, options, None, &mut out),
        Format::Candump => can::read(path, options, can::candump::Frames::open(path)?, &mut out),
        #[cfg(feature = "blf")]
        Format::Asc | Format::Blf => can::read(
            path,
            options,
            can::vector::Frames::open(path, format)?,
            &mut out,
        ),
        #[cfg(not(feature = "blf"))]
        Format::Asc | Format::Blf => Err(crate::wrong(
            path,
            None,
            format!(
                "this is a CAN log of the format {}, which this program was built without",
                format.name()
            ),
            "a `monorig` built with the feature `blf`, or the log as candump",
        )),
    };
    let done = guarded(read).unwrap_or_else(|what| {
        Err(crate::wrong(
            path,
            None,
            format!("this {} file cannot be read: {what}", format.name()),
            "a file that is whole; see what `monorig inspect` reads of it",
        ))
    });
    out.flush();
    done
}

/// The parts of a file that can be read side by side, each in the order of its own time: the channel groups of an MDF file that hold a
/// wanted column, else the file as a whole.
pub(crate) fn parts(path: &Path, options: &ReadOptions) -> Result<Vec<Part>, Error> {
    regular(path)?;
    let format = Format::of(path)?;
    let groups = match format {
        Format::Mdf => guarded(|| mdf::groups(path, options)).unwrap_or_else(|what| {
            Err(crate::wrong(
                path,
                None,
                format!("this MDF file cannot be read: {what}"),
                "a file that is whole",
            ))
        })?,
        _ => vec![None],
    };
    Ok(groups
        .into_iter()
        .map(|group| Part {
            path: path.to_owned(),
            format,
            options: options.clone(),
            group,
        })
        .collect())
}

/// A part of a file that is read in the order of its own time.
pub(crate) struct Part {
    /// The file.
    pub path: PathBuf,
    /// Its format.
    pub format: Format,
    options: ReadOptions,
    /// Channel group of an MDF file.
    group: Option<(usize, usize)>,
}

impl Part {
    /// Read it.
    pub fn scan(&self, sink: &mut dyn FnMut(Chunk) -> bool) -> Result<(), Error> {
        match self.group {
            None => scan_as(self.format, &self.path, &self.options, sink),
            Some(_) => {
                let mut out = Out::new(sink);
                let done = guarded(|| mdf::read(&self.path, &self.options, self.group, &mut out))
                    .unwrap_or_else(|what| {
                        Err(crate::wrong(
                            &self.path,
                            None,
                            format!("this MDF file cannot be read: {what}"),
                            "a file that is whole",
                        ))
                    });
                out.flush();
                done
            }
        }
    }
}
