//! Parquet: a file a table, `arrival_ns` and `stamp_ns` as whole numbers, units in the metadata of the columns.

use super::failed::failed;
use super::tables::{Instants, Table};
use super::writer::{LogWriter, NewLog, RowWriter};
use crate::io;
use ::parquet::arrow::ArrowWriter;
use ::parquet::basic::{Compression, ZstdLevel};
use ::parquet::file::properties::WriterProperties;
use arrow_array::builder::Float64Builder;
use arrow_array::{ArrayRef, Int64Array, RecordBatch};
use arrow_schema::{DataType, Field, Schema, SchemaRef};
use monorig_sim::error::Error;
use serde_json::Value;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Rows of a batch.
const ROWS: usize = 8192;

/// The writer of Parquet.
pub(super) struct ParquetWriter;

impl LogWriter for ParquetWriter {
    fn name(&self) -> &'static str {
        "parquet"
    }

    fn files(&self) -> &'static str {
        "A Parquet file for each instrument"
    }

    fn create(&self, log: NewLog<'_>) -> Result<Box<dyn RowWriter>, Error> {
        let file = |table: &Table| match table.columns.is_empty() {
            true => Ok(None),
            false => TableFile::create(log.folder, table).map(Some),
        };
        let files: Result<_, Error> = log.tables.iter().map(file).collect();
        Ok(Box::new(ParquetFiles(files?)))
    }

    fn adapt(&self, map: &mut Value, _: &str) {
        map["time"]["column"] = "arrival_ns".into();
    }
}

/// The files, by the index of their table.
struct ParquetFiles(Vec<Option<TableFile>>);

struct TableFile {
    path: PathBuf,
    writer: ArrowWriter<std::fs::File>,
    schema: SchemaRef,
    times: [Vec<i64>; 2],
    columns: Vec<Vec<f64>>,
}

impl TableFile {
    fn create(folder: &Path, table: &Table) -> Result<Self, Error> {
        let path = folder.join(format!("{}.parquet", table.name));
        let time = |name| Field::new(name, DataType::Int64, false);
        let mut fields = vec![time("arrival_ns"), time("stamp_ns")];
        for (name, unit) in table.columns.iter().zip(&table.units) {
            let unit = HashMap::from([("unit".to_owned(), (*unit).to_owned())]);
            fields.push(Field::new(name, DataType::Float64, true).with_metadata(unit));
        }
        let schema = Arc::new(Schema::new(fields));
        let failed = |e: &dyn std::fmt::Display| failed(&path)(e);
        let level = ZstdLevel::try_new(3).map_err(|e| failed(&e))?;
        let properties = WriterProperties::builder()
            .set_dictionary_enabled(false)
            .set_compression(Compression::ZSTD(level))
            .build();
        let file = std::fs::File::create(&path).map_err(|e| io(&path, e))?;
        let writer = ArrowWriter::try_new(file, schema.clone(), Some(properties));
        Ok(Self {
            writer: writer.map_err(|e| failed(&e))?,
            path,
            schema,
            times: Default::default(),
            columns: vec![Vec::new(); table.columns.len()],
        })
    }

    fn flush(&mut self) -> Result<(), Error> {
        let failed = failed(&self.path);
        let mut arrays: Vec<ArrayRef> = Vec::new();
        for times in &mut self.times {
            arrays.push(Arc::new(Int64Array::from(std::mem::take(times))));
        }
        for column in &mut self.columns {
            let mut builder = Float64Builder::with_capacity(column.len());
            column
                .drain(..)
                .for_each(|x| builder.append_option((!x.is_nan()).then_some(x)));
            arrays.push(Arc::new(builder.finish()));
        }
        let batch = RecordBatch::try_new(self.schema.clone(), arrays).map_err(|e| failed(&e))?;
        self.writer.write(&batch).map_err(|e| failed(&e))
    }
}

impl RowWriter for ParquetFiles {
    fn row(&mut self, table: usize, at: Instants, values: &[f64]) -> Result<(), Error> {
        let Some(file) = self.0.get_mut(table).and_then(Option::as_mut) else {
            return Ok(());
        };
        let [arrivals, stamps] = &mut file.times;
        arrivals.push(at.arrival_ns);
        stamps.push(at.stamp_ns);
        for (column, x) in file.columns.iter_mut().zip(values) {
            column.push(*x);
        }
        match stamps.len() >= ROWS {
            true => file.flush(),
            false => Ok(()),
        }
    }

    fn finish(self: Box<Self>) -> Result<u64, Error> {
        for mut file in self.0.into_iter().flatten() {
            file.flush()?;
            let closed = file.writer.close();
            closed.map_err(|e| failed(&file.path)(&e))?;
        }
        Ok(0)
    }
}
