//! CSV: a file a table; numbers as the shortest decimal that is read back to the same bits.

use super::{Instants, Table, Writer};
use crate::io;
use monorig_sim::error::Error;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

/// The files, by the index of their table.
pub(super) struct Files {
    files: Vec<Option<(PathBuf, BufWriter<File>)>>,
    line: String,
}

impl Files {
    /// A file in `folder` for each table with columns.
    pub fn create(folder: &Path, tables: &[Table]) -> Result<Self, Error> {
        let mut files = Vec::new();
        for table in tables {
            if table.columns.is_empty() {
                files.push(None);
                continue;
            }
            let path = folder.join(format!("{}.csv", table.name));
            let mut file = BufWriter::new(File::create(&path).map_err(|e| io(&path, e))?);
            let title = format!("arrival_ns,stamp_ns,{}\n", table.columns.join(","));
            file.write_all(title.as_bytes()).map_err(|e| io(&path, e))?;
            files.push(Some((path, file)));
        }
        Ok(Self {
            files,
            line: String::new(),
        })
    }
}

impl Writer for Files {
    fn row(&mut self, table: usize, at: Instants, values: &[f64]) -> Result<(), Error> {
        let Some((path, file)) = self.files.get_mut(table).and_then(Option::as_mut) else {
            return Ok(());
        };
        self.line.clear();
        let _ = write!(self.line, "{},{}", at.arrival_ns, at.stamp_ns);
        for x in values {
            let _ = match x.is_nan() {
                true => write!(self.line, ","),
                false => write!(self.line, ",{x:?}"),
            };
        }
        self.line.push('\n');
        file.write_all(self.line.as_bytes())
            .map_err(|e| io(path, e))
    }

    fn finish(self: Box<Self>) -> Result<u64, Error> {
        for (path, mut file) in self.files.into_iter().flatten() {
            file.flush().map_err(|e| io(&path, e))?;
        }
        Ok(0)
    }
}
