//! Parquet: columns of numbers beside a column of time, by batches.

use super::csv::time_column;
use super::{Column, Out, ReadOptions, Row};
use crate::{io, wrong};
use ::parquet::arrow::ProjectionMask;
use ::parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use arrow::array::{Array, ArrayRef, AsArray};
use arrow::buffer::NullBuffer;
use arrow::compute::cast;
use arrow::datatypes::{DataType, Field, Float64Type, Int64Type, TimeUnit as ArrowUnit};
use monorig_sim::error::Error;
use std::fs::File;
use std::path::Path;

/// Rows of a batch.
const BATCH: usize = 4096;

/// Whether a column holds numbers.
fn is_number(field: &Field) -> bool {
    field.data_type().is_numeric() || *field.data_type() == DataType::Boolean
}

/// Reads a file.
pub(super) fn read(path: &Path, options: &ReadOptions, out: &mut Out<'_>) -> Result<(), Error> {
    let broken = |e: &dyn std::fmt::Display| {
        wrong(
            path,
            None,
            format!("this Parquet file cannot be read: {e}"),
            "a whole file, compressed with nothing, snappy, gzip or zstd",
        )
    };
    let file = File::open(path).map_err(|e| io(path, e))?;
    let builder = ParquetRecordBatchReaderBuilder::try_new(file).map_err(|e| broken(&e))?;
    let schema = builder.schema().clone();
    let names: Vec<String> = schema.fields().iter().map(|f| f.name().clone()).collect();
    let (time, unit) = time_column(path, &names, options)?;
    let wanted: Vec<usize> = schema
        .fields()
        .iter()
        .enumerate()
        .filter(|(i, f)| *i != time && is_number(f) && options.wants("", f.name()))
        .map(|(i, _)| i)
        .collect();
    let columns = wanted.iter().map(|i| schema.field(*i)).map(|f| Column {
        name: f.name().clone(),
        unit: f.metadata().get("unit").cloned().unwrap_or_default(),
    });
    let table = out.table("", columns.collect());
    let roots = wanted.iter().copied().chain([time]);
    let mask = ProjectionMask::roots(builder.parquet_schema(), roots);
    let batches = builder
        .with_projection(mask)
        .with_batch_size(BATCH)
        .build()
        .map_err(|e| broken(&e))?;
    let mut place = 0;
    for batch in batches {
        let batch = batch.map_err(|e| broken(&e))?;
        let column = |i: usize| {
            names
                .get(i)
                .and_then(|n| batch.column_by_name(n))
                .ok_or_else(|| broken(&"a column is missing"))
        };
        let stamps = stamps(column(time)?, unit).map_err(|e| broken(&e))?;
        let mut values = Vec::with_capacity(wanted.len());
        for &i in &wanted {
            values.push(cast(column(i)?, &DataType::Float64).map_err(|e| broken(&e))?);
        }
        let values: Vec<(&[f64], Option<&NullBuffer>)> = values
            .iter()
            .map(|a| a.as_primitive::<Float64Type>())
            .map(|a| {
                (
                    a.values().as_ref(),
                    a.nulls().filter(|n| n.null_count() > 0),
                )
            })
            .collect();
        for (row, stamp) in stamps.into_iter().enumerate() {
            place += 1;
            let Some(stamp_ns) = stamp else {
                return Err(wrong(
                    path,
                    None,
                    format!("row {place} has no time"),
                    "a time in each row",
                ));
            };
            let row_values = values.iter().map(|(values, nulls)| {
                let there = nulls.is_none_or(|nulls| nulls.is_valid(row));
                let value = values.get(row).copied().filter(|_| there);
                value.unwrap_or(f64::NAN)
            });
            let at = Row {
                table,
                piece: 0,
                stamp_ns,
                arrival_ns: stamp_ns,
                place,
                first: 0,
            };
            if !out.row(at, row_values) {
                return Ok(());
            }
        }
    }
    Ok(())
}

/// The stamps of a column of time, ns.
fn stamps(column: &ArrayRef, unit: crate::notation::TimeUnit) -> Result<Vec<Option<i64>>, String> {
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
