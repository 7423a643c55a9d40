//! Parquet: columns of numbers beside a column of time, by batches.

use super::arrays::floats;
use super::{Asked, LogColumn, LogReader, Out, Row, time_column};
use crate::{io, wrong};
use ::parquet::arrow::ProjectionMask;
use ::parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use arrow_array::{Array, Float64Array};
use arrow_buffer::NullBuffer;
use arrow_schema::{DataType, Field, FieldRef};
use monorig_sim::error::Error;
use std::fs::File;
use std::path::Path;

/// Most columns that are read: each takes 350 kB before a value of it is read.
const MAX_COLUMNS: usize = 2048;
/// Rows of a batch.
const BATCH: usize = 4096;

/// True if a column holds numbers.
fn is_number(field: &Field) -> bool {
    let of_values = match field.data_type() {
        DataType::Dictionary(_, values) => values,
        other => other,
    };
    of_values.is_numeric() || *of_values == DataType::Boolean
}

/// The reader of Parquet.
pub(super) struct ParquetReader;

impl LogReader for ParquetReader {
    fn name(&self) -> &'static str {
        "Parquet"
    }

    fn magics(&self) -> &[&'static [u8]] {
        &[b"PAR1"]
    }

    fn endings(&self) -> &[&'static str] {
        &["parquet"]
    }

    fn read(&self, asked: Asked<'_>, out: &mut Out<'_>) -> Result<(), Error> {
        let Asked { path, options, .. } = asked;
        let file = File::open(path).map_err(|e| io(path, e))?;
        let builder =
            ParquetRecordBatchReaderBuilder::try_new(file).map_err(|e| broken(path, &e))?;
        let schema = builder.schema().clone();
        let names: Vec<String> = schema.fields().iter().map(|f| f.name().clone()).collect();
        let (time, mut unit) = time_column::find(path, &names, options)?;
        let is_wanted =
            |(i, f): &(usize, &FieldRef)| *i != time && is_number(f) && options.wants("", f.name());
        let wanted = schema.fields().iter().enumerate().filter(is_wanted);
        let wanted: Vec<usize> = wanted.map(|(i, _)| i).collect();
        let columns = wanted.iter().map(|i| schema.field(*i)).map(|f| LogColumn {
            name: f.name().clone(),
            unit: f.metadata().get("unit").cloned().unwrap_or_default(),
        });
        let table = out.table("", columns.collect());
        for (i, field) in schema.fields().iter().enumerate() {
            if i != time && !is_number(field) {
                out.unread(format!("column {}: {}", field.name(), field.data_type()));
            }
        }
        if wanted.len() > MAX_COLUMNS {
            let message = format!(
                "this file has {} columns of numbers, and each needs memory before its values are read",
                wanted.len()
            );
            let help =
                format!("use at most {MAX_COLUMNS} columns; a map file names the needed columns");
            return Err(wrong(path, None, message, help));
        }
        let roots = wanted.iter().copied().chain([time]);
        let mask = ProjectionMask::roots(builder.parquet_schema(), roots);
        let batches = builder
            .with_projection(mask)
            .with_batch_size(BATCH)
            .build()
            .map_err(|e| broken(path, &e))?;
        let mut place = 0;
        for batch in batches {
            let batch = batch.map_err(|e| broken(path, &e))?;
            let column = |i: usize| {
                let named = names.get(i).and_then(|n| batch.column_by_name(n));
                named.ok_or_else(|| broken(path, &"a column is missing"))
            };
            let times = column(time)?;
            let unit = unit.get_or_insert_with(|| time_column::guessed_of(times.as_ref()));
            let stamps =
                time_column::stamps(times.as_ref(), *unit).map_err(|e| broken(path, &e))?;
            let mut values = Vec::with_capacity(wanted.len());
            for &i in &wanted {
                let numbers = floats(column(i)?.as_ref());
                values.push(numbers.ok_or_else(|| broken(path, &"a column has no numbers"))?);
            }
            let values: Vec<_> = values.iter().map(numbers).collect();
            for (row, stamp) in stamps.into_iter().enumerate() {
                place += 1;
                let Some(stamp_ns) = stamp else {
                    let message = format!("row {place} has no time");
                    return Err(wrong(path, None, message, "a time in each row"));
                };
                let row_values = values.iter().map(|(values, nulls)| {
                    let there = nulls.is_none_or(|nulls| nulls.is_valid(row));
                    let value = values.get(row).copied().filter(|_| there);
                    value.unwrap_or(f64::NAN)
                });
                if !out.row(Row::at(table, stamp_ns, place), row_values) {
                    return Ok(());
                }
            }
        }
        Ok(())
    }
}

fn broken(path: &Path, e: &dyn std::fmt::Display) -> Error {
    wrong(
        path,
        None,
        format!("this Parquet file cannot be read: {e}"),
        "use a complete file, uncompressed or compressed with snappy, gzip or zstd",
    )
}

/// The numbers of a column, and which of them are there; none where all are.
fn numbers(column: &Float64Array) -> (&[f64], Option<&NullBuffer>) {
    let nulls = column.nulls().filter(|n| n.null_count() > 0);
    (column.values().as_ref(), nulls)
}
