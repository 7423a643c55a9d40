//! Parquet: columns of numbers beside a column of time, by batches.

use super::{LogColumn, LogReader, Out, ReadOptions, Row, Section, time_column};
use crate::notation::TimeUnit;
use crate::{io, wrong};
use ::parquet::arrow::ProjectionMask;
use ::parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use arrow::array::{Array, ArrayRef, AsArray};
use arrow::buffer::NullBuffer;
use arrow::compute::cast;
use arrow::datatypes::{DataType, Field, FieldRef, Float64Type, Int64Type, TimeUnit as ArrowUnit};
use monorig_sim::error::Error;
use std::fs::File;
use std::path::Path;

/// Most columns that are read: each takes 350 kB before a value of it is read.
const MAX_COLUMNS: usize = 2048;
/// Rows of a batch.
const BATCH: usize = 4096;

/// True if a column holds numbers.
fn is_number(field: &Field) -> bool {
    field.data_type().is_numeric() || *field.data_type() == DataType::Boolean
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

    fn read(
        &self,
        path: &Path,
        options: &ReadOptions,
        _: Section,
        out: &mut Out<'_>,
    ) -> Result<(), Error> {
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
        if wanted.len() > MAX_COLUMNS {
            let message = format!(
                "this file has {} columns of numbers, and each takes memory before a value of it is read",
                wanted.len()
            );
            let help =
                format!("at most {MAX_COLUMNS} columns; a map file names those that are wanted");
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
            let unit = unit.get_or_insert_with(|| guessed(times.as_ref()));
            let stamps = stamps(times, *unit).map_err(|e| broken(path, &e))?;
            let mut values = Vec::with_capacity(wanted.len());
            for &i in &wanted {
                let numbers = cast(column(i)?, &DataType::Float64);
                values.push(numbers.map_err(|e| broken(path, &e))?);
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
        "a whole file, compressed with nothing, snappy, gzip or zstd",
    )
}

/// The numbers of a column, and which of them are there; none where all are.
fn numbers(column: &ArrayRef) -> (&[f64], Option<&NullBuffer>) {
    let column = column.as_primitive::<Float64Type>();
    let nulls = column.nulls().filter(|n| n.null_count() > 0);
    (column.values().as_ref(), nulls)
}

/// The unit of a column of time by its first value.
fn guessed(times: &dyn Array) -> TimeUnit {
    let words = cast(times, &DataType::Utf8).ok();
    let first = words
        .as_ref()
        .and_then(|w| w.as_string::<i32>().iter().flatten().next());
    first.map_or(TimeUnit::Seconds, time_column::guessed)
}

/// The stamps of a column of time, ns.
fn stamps(column: &ArrayRef, unit: TimeUnit) -> Result<Vec<Option<i64>>, String> {
    let per_unit = |u: &ArrowUnit| match u {
        ArrowUnit::Second => 1_000_000_000,
        ArrowUnit::Millisecond => 1_000_000,
        ArrowUnit::Microsecond => 1_000,
        ArrowUnit::Nanosecond => 1,
    };
    let whole = |each: &dyn Fn(i64) -> Option<i64>| -> Result<Vec<Option<i64>>, String> {
        let ints = cast(column, &DataType::Int64).map_err(|e| e.to_string())?;
        Ok(ints
            .as_primitive::<Int64Type>()
            .iter()
            .map(|x| each(x?))
            .collect())
    };
    match column.data_type() {
        DataType::Timestamp(u, _) | DataType::Duration(u) => whole(&|x| x.checked_mul(per_unit(u))),
        t if t.is_integer() => whole(&|x| unit.of_i64(x)),
        t if t.is_floating() => {
            let floats = cast(column, &DataType::Float64).map_err(|e| e.to_string())?;
            Ok(floats
                .as_primitive::<Float64Type>()
                .iter()
                .map(|x| unit.of_f64(x?))
                .collect())
        }
        DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View => {
            let words = cast(column, &DataType::Utf8).map_err(|e| e.to_string())?;
            Ok(words
                .as_string::<i32>()
                .iter()
                .map(|x| unit.parse(x?))
                .collect())
        }
        other => Err(format!("its column of time is of the type {other}")),
    }
}
