//! CSV: a file a table; numbers as the shortest decimal that is read back to the same bits.

use super::failed::failed;
use super::tables::Instants;
use super::writer::{LogWriter, NewLog, RowWriter};
use monorig_sim::error::Error;
use serde_json::Value;
use std::fs::File;
use std::path::PathBuf;

/// The writer of CSV.
pub(super) struct CsvWriter;

impl LogWriter for CsvWriter {
    fn name(&self) -> &'static str {
        "csv"
    }

    fn files(&self) -> &'static str {
        "A file of text for each instrument"
    }

    fn create(&self, log: NewLog<'_>) -> Result<Box<dyn RowWriter>, Error> {
        let mut files = Vec::new();
        for table in log.tables {
            if table.columns.is_empty() {
                files.push(None);
                continue;
            }
            let path = log.folder.join(format!("{}.csv", table.name));
            let mut file = ::csv::Writer::from_path(&path).map_err(|e| failed(&path)(&e))?;
            let times = ["arrival_ns", "stamp_ns"].into_iter();
            let title = times.chain(table.columns.iter().map(String::as_str));
            file.write_record(title).map_err(|e| failed(&path)(&e))?;
            files.push(Some((path, file)));
        }
        Ok(Box::new(CsvFiles(files)))
    }

    fn adapt(&self, map: &mut Value, _: &str) {
        map["time"]["column"] = "arrival_ns".into();
    }
}

/// The files, by the index of their table.
struct CsvFiles(Vec<Option<(PathBuf, ::csv::Writer<File>)>>);

impl RowWriter for CsvFiles {
    fn row(&mut self, table: usize, at: Instants, values: &[f64]) -> Result<(), Error> {
        let Some((path, file)) = self.0.get_mut(table).and_then(Option::as_mut) else {
            return Ok(());
        };
        let times = [at.arrival_ns.to_string(), at.stamp_ns.to_string()];
        let numbers = values.iter().map(|x| match x.is_nan() {
            true => String::new(),
            false => format!("{x:?}"),
        });
        let written = file.write_record(times.into_iter().chain(numbers));
        written.map_err(|e| failed(path)(&e))
    }

    fn finish(self: Box<Self>) -> Result<u64, Error> {
        for (path, mut file) in self.0.into_iter().flatten() {
            file.flush().map_err(|e| failed(&path)(&e))?;
        }
        Ok(0)
    }
}
