//! The functions of a format that logs are written in.

use super::tables::{Instants, Table};
use monorig_sim::error::Error;
use std::path::Path;

/// A log that is to be written.
#[derive(Clone, Copy)]
pub(super) struct NewLog<'a> {
    /// The folder of the run.
    pub run: &'a Path,
    pub folder: &'a Path,
    pub name: &'a str,
    pub tables: &'a [Table],
}

/// Writes logs of one format. A further format is a file with an `impl` of this trait, and a line in `FORMATS`.
pub(super) trait LogWriter: Sync {
    /// The name on the command line.
    fn name(&self) -> &'static str;

    /// The files of a log, for the help of a command.
    fn files(&self) -> &'static str;

    /// True if values are rounded.
    fn is_lossy(&self) -> bool {
        false
    }

    /// Creates the files of a log.
    fn create(&self, log: NewLog<'_>) -> Result<Box<dyn RowWriter>, Error>;

    /// The file of all tables; none if each table has a file of its own, `TABLE.FORMAT`.
    fn only_file(&self, _name: &str) -> Option<String> {
        None
    }

    /// A column as the map file names it.
    fn column(&self, table: &Table, column: usize) -> String {
        let name = table.columns.get(column).map_or("", String::as_str);
        match self.only_file("") {
            Some(_) => format!("{}.{name}", table.name),
            None => name.to_owned(),
        }
    }

    /// Changes the keys of the map file that are not the same in all formats.
    fn adapt(&self, _map: &mut serde_json::Value, _name: &str) {}
}

/// Writes the rows of a log.
pub(super) trait RowWriter {
    /// A row of the table with this index: when it was taken and recorded (ns of the run), and its values; not a number
    /// where there is none.
    fn row(&mut self, table: usize, at: Instants, values: &[f64]) -> Result<(), Error>;
    /// Ends the files when all rows are written; how many values were beyond the range of their signal.
    fn finish(self: Box<Self>) -> Result<u64, Error>;
}
