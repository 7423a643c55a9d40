//! The columns of a run as an Apache Parquet file.
//!
//! One row group per [`Chunk`], one column per channel, after a column `time` (s). The unit of a column is its Arrow
//! field metadata under `unit`; scenario and seed are schema metadata. NaN (no value in this row) is stored as null.
//! Events end up in the file's key-value metadata under `events`, as JSON `[[time_ns, text], …]`; with scenario and
//! seed also where pandas (2.1 or later) keeps the attributes of a table, `df.attrs`, so that they outlive reading and
//! writing by it. The same chunks give the same bytes: nothing in the file comes from a clock.

use super::{Channel, Chunk, Layout, Sink, whole};
use crate::error::Error;
use arrow_array::{ArrayRef, Float64Array, RecordBatch};
use arrow_schema::{DataType, Field, Schema, SchemaRef};
use parquet::arrow::arrow_writer::ArrowWriterOptions;
use parquet::arrow::{ARROW_SCHEMA_META_KEY, ArrowWriter, encode_arrow_schema};
use parquet::basic::{Compression, Encoding, ZstdLevel};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Key of a column's unit in the Arrow field metadata.
pub(crate) const UNIT: &str = "unit";
/// Key of the events in the file metadata.
pub(crate) const EVENTS: &str = "events";
/// Key under which pandas keeps the attributes of a table, as JSON, in the schema's metadata.
pub(crate) const PANDAS: &str = "PANDAS_ATTRS";

/// Writes a Parquet file under a temporary name, and moves the complete file to its place.
///
/// Dropped before [`Sink::finish`] (an error, an interrupt), it still closes the file and moves it: what was recorded
/// up to then can be read.
pub struct ParquetSink {
    path: PathBuf,
    partial: PathBuf,
    open: Option<Open>,
}

/// A file that is being written.
struct Open {
    writer: ArrowWriter<File>,
    schema: SchemaRef,
    events: Vec<(i64, String)>,
}

impl ParquetSink {
    /// A sink for `path`. Creates the temporary file, so that a folder that cannot be written shows before the run.
    pub fn create(path: impl Into<PathBuf>) -> Result<Self, Error> {
        let path = path.into();
        let partial = whole::partial(&path);
        whole::create(&partial)?;
        Ok(Self {
            path,
            partial,
            open: None,
        })
    }
}

impl Sink for ParquetSink {
    fn begin(&mut self, layout: &Layout<'_>) -> Result<(), Error> {
        let file = File::create(&self.partial).map_err(Error::at(&self.partial))?;
        let schema = schema(layout);
        // the schema goes into the file at the end: the events are among its attributes for pandas
        let options = ArrowWriterOptions::new().with_properties(properties()?);
        let options = options.with_skip_arrow_metadata(true);
        let writer = ArrowWriter::try_new_with_options(file, schema.clone(), options)
            .map_err(broken_write(&self.path))?;
        self.open = Some(Open {
            writer,
            schema,
            events: Vec::new(),
        });
        Ok(())
    }

    fn chunk(&mut self, chunk: &Chunk) -> Result<(), Error> {
        let Some(open) = &mut self.open else {
            return Err(not_begun(&self.path));
        };
        open.events.extend_from_slice(&chunk.events);
        if chunk.time_ns.is_empty() {
            return Ok(());
        }
        let seconds = chunk.time_ns.iter().map(|&ns| ns as f64 * 1e-9);
        let time: ArrayRef = Arc::new(Float64Array::from_iter_values(seconds));
        let values = chunk.values.iter().map(|v| column(v));
        let columns = std::iter::once(time).chain(values).collect();
        let batch = RecordBatch::try_new(open.schema.clone(), columns).map_err(|e| {
            let invalid = std::io::ErrorKind::InvalidInput;
            Error::at(&self.path)(std::io::Error::new(invalid, e.to_string()))
        })?;
        open.writer
            .write(&batch)
            .and_then(|()| open.writer.flush())
            .map_err(broken_write(&self.path))
    }

    fn finish(&mut self) -> Result<(), Error> {
        let Some(mut open) = self.open.take() else {
            return Err(not_begun(&self.path));
        };
        let events = serde_json::to_string(&open.events);
        let events = events.map_err(|e| Error::at(&self.path)(e.into()))?;
        let schema = encode_arrow_schema(&for_pandas(&open.schema, &open.events));
        for (key, value) in [(ARROW_SCHEMA_META_KEY, schema), (EVENTS, events)] {
            open.writer
                .append_key_value_metadata(KeyValue::new(key.into(), value));
        }
        open.writer.close().map_err(broken_write(&self.path))?;
        std::fs::rename(&self.partial, &self.path).map_err(Error::at(&self.path))
    }
}

impl Drop for ParquetSink {
    fn drop(&mut self) {
        if self.open.is_some() {
            // Nobody is left to hear of an error; a file that could not be closed is removed below.
            let _ = self.finish();
        }
        let _ = std::fs::remove_file(&self.partial);
    }
}

/// The columns of a run: `time` and one nullable column per channel, each with its unit.
pub fn schema(layout: &Layout<'_>) -> SchemaRef {
    let field = |name: &str, unit: &str, nullable| {
        Field::new(name, DataType::Float64, nullable)
            .with_metadata(HashMap::from([(UNIT.to_owned(), unit.to_owned())]))
    };
    let channels = layout
        .channels
        .iter()
        .map(|Channel { path, unit }| field(path, unit, true));
    let fields: Vec<Field> = std::iter::once(field("time", "s", false))
        .chain(channels)
        .collect();
    let about = HashMap::from([
        ("scenario".to_owned(), layout.scenario.to_owned()),
        ("seed".to_owned(), layout.seed.to_string()),
    ]);
    Arc::new(Schema::new_with_metadata(fields, about))
}

/// The schema, with the description of the run and the events as attributes of pandas.
fn for_pandas(schema: &Schema, events: &[(i64, String)]) -> Schema {
    let mut attributes = serde_json::json!({ EVENTS: events });
    // in order: the same run, the same bytes
    for (key, value) in schema.metadata().iter().collect::<BTreeMap<_, _>>() {
        attributes[key] = value.clone().into();
    }
    let mut metadata = schema.metadata().clone();
    metadata.insert(PANDAS.to_owned(), attributes.to_string());
    Schema::new_with_metadata(schema.fields().clone(), metadata)
}

/// A column of a run; NaN becomes null.
pub fn column(values: &[f64]) -> ArrayRef {
    if values.iter().any(|x| x.is_nan()) {
        let sparse = values.iter().map(|&x| (!x.is_nan()).then_some(x));
        Arc::new(sparse.collect::<Float64Array>())
    } else {
        Arc::new(Float64Array::from_iter_values(values.iter().copied()))
    }
}

/// Floating-point noise has no repeated values, so no dictionary; the bytes of equal significance next to each other
/// compress well, and fast.
fn properties() -> Result<WriterProperties, Error> {
    let level = ZstdLevel::try_new(1).map_err(broken_write(Path::new("channels.parquet")))?;
    Ok(WriterProperties::builder()
        .set_dictionary_enabled(false)
        .set_encoding(Encoding::BYTE_STREAM_SPLIT)
        .set_compression(Compression::ZSTD(level))
        .set_statistics_enabled(EnabledStatistics::None)
        .build())
}

fn broken_write(path: &Path) -> impl FnOnce(ParquetError) -> Error {
    move |e| {
        let source = match e {
            ParquetError::External(inner) => match inner.downcast::<std::io::Error>() {
                Ok(source) => *source,
                Err(other) => std::io::Error::other(other),
            },
            other => std::io::Error::other(other),
        };
        Error::at(path)(source)
    }
}

fn not_begun(path: &Path) -> Error {
    Error::at(path)(std::io::Error::other(
        "the recording was not started, or is finished",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::testing::{layout_of, sample_chunk, sample_train};
    use arrow_array::Array;
    use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

    fn channels(n: usize) -> Vec<Channel> {
        (0..n)
            .map(|i| Channel {
                path: format!("sensors/imu/channel_{i}"),
                unit: if i % 2 == 0 { "m/s²" } else { "rad" },
            })
            .collect()
    }

    fn record(path: &Path, channels: &[Channel], chunks: &[Chunk]) {
        let train = sample_train();
        let mut sink = ParquetSink::create(path).unwrap();
        sink.begin(&layout_of(channels, &train)).unwrap();
        for chunk in chunks {
            sink.chunk(chunk).unwrap();
        }
        sink.finish().unwrap();
    }

    /// pandas keeps the attributes of a table and nothing else of the metadata.
    #[test]
    fn events_outlive_pandas() {
        let dir = tempfile::tempdir().unwrap();
        let (path, by_pandas) = (dir.path().join("a.parquet"), dir.path().join("b.parquet"));
        let chunk = sample_chunk(5, 0, 40);
        record(&path, &channels(5), std::slice::from_ref(&chunk));
        let reader = ParquetRecordBatchReaderBuilder::try_new(File::open(&path).unwrap()).unwrap();
        let kept = HashMap::from([(
            PANDAS.to_owned(),
            reader.schema().metadata()[PANDAS].clone(),
        )]);
        let fields = reader.schema().fields().iter();
        let fields: Vec<Field> = fields
            .map(|f| f.as_ref().clone().with_metadata(HashMap::new()))
            .collect();
        let schema = Arc::new(Schema::new_with_metadata(fields, kept));
        let mut writer =
            ArrowWriter::try_new(File::create(&by_pandas).unwrap(), schema.clone(), None).unwrap();
        for batch in reader.build().unwrap() {
            let columns = batch.unwrap().columns().to_vec();
            writer
                .write(&RecordBatch::try_new(schema.clone(), columns).unwrap())
                .unwrap();
        }
        writer.close().unwrap();
        let there = crate::record::readback::read(&path).unwrap();
        let back = crate::record::readback::read(&by_pandas).unwrap();
        assert_eq!(there.events, chunk.events);
        assert_eq!((&back.events, back.rows), (&there.events, there.rows));
        assert_eq!((&back.scenario, &back.seed), (&there.scenario, &there.seed));
    }

    /// A file that is read back is equal to the columns sent: every bit, nulls for NaN, units, row groups, events.
    #[test]
    fn reads_back_what_was_sent() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("channels.parquet");
        let channels = channels(5);
        let chunks = [sample_chunk(5, 0, 40), sample_chunk(5, 40, 3)];
        record(&path, &channels, &chunks);

        let names: Vec<_> = std::fs::read_dir(dir.path()).unwrap().collect();
        assert_eq!(names.len(), 1, "a temporary file was left: {names:?}");
        let reader = ParquetRecordBatchReaderBuilder::try_new(File::open(&path).unwrap()).unwrap();
        assert_eq!(reader.metadata().num_row_groups(), 2);
        let schema = reader.schema().clone();
        assert_eq!(schema.metadata()["seed"], "7");
        assert_eq!(schema.field(0).name(), "time");
        for (field, channel) in schema.fields().iter().skip(1).zip(&channels) {
            assert_eq!(field.name(), &channel.path);
            assert_eq!(field.metadata()[UNIT], channel.unit);
        }
        let pairs = reader.metadata().file_metadata().key_value_metadata();
        let events = pairs.unwrap().iter().find(|kv| kv.key == EVENTS).unwrap();
        let events: Vec<(i64, String)> =
            serde_json::from_str(events.value.as_ref().unwrap()).unwrap();
        assert_eq!(
            events,
            [chunks[0].events.clone(), chunks[1].events.clone()].concat()
        );

        let batches: Vec<RecordBatch> = reader.build().unwrap().map(|b| b.unwrap()).collect();
        let read = arrow_select::concat::concat_batches(&schema, &batches).unwrap();
        for c in 0..6 {
            let sent: Vec<f64> = chunks
                .iter()
                .flat_map(|k| match c {
                    0 => k.time_ns.iter().map(|&t| t as f64 * 1e-9).collect(),
                    _ => k.values[c - 1].clone(),
                })
                .collect();
            let got = read
                .column(c)
                .as_any()
                .downcast_ref::<Float64Array>()
                .unwrap();
            assert_eq!(got.len(), sent.len());
            for (i, &x) in sent.iter().enumerate() {
                assert_eq!(got.is_null(i), x.is_nan());
                assert!(x.is_nan() || got.value(i).to_bits() == x.to_bits());
            }
        }
    }

    #[test]
    fn same_chunks_same_bytes() {
        let dir = tempfile::tempdir().unwrap();
        let (a, b) = (dir.path().join("a"), dir.path().join("b"));
        let chunks = [sample_chunk(4, 0, 100)];
        record(&a, &channels(4), &chunks);
        record(&b, &channels(4), &chunks);
        assert_eq!(std::fs::read(a).unwrap(), std::fs::read(b).unwrap());
    }

    /// An interrupted run leaves a file that can be read.
    #[test]
    fn dropped_is_closed() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("channels.parquet");
        let train = sample_train();
        let channels = channels(2);
        {
            let mut sink = ParquetSink::create(&path).unwrap();
            sink.begin(&layout_of(&channels, &train)).unwrap();
            sink.chunk(&sample_chunk(2, 0, 10)).unwrap();
        }
        let reader = ParquetRecordBatchReaderBuilder::try_new(File::open(&path).unwrap()).unwrap();
        assert_eq!(reader.metadata().file_metadata().num_rows(), 10);
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[test]
    fn wrong_shape_and_bad_folder_are_errors() {
        let dir = tempfile::tempdir().unwrap();
        let missing = dir.path().join("no/such/folder/channels.parquet");
        assert!(
            matches!(ParquetSink::create(&missing), Err(Error::Io { path, .. })
            if path.starts_with(dir.path()))
        );

        let path = dir.path().join("channels.parquet");
        let train = sample_train();
        let channels = channels(3);
        let mut sink = ParquetSink::create(&path).unwrap();
        assert!(sink.chunk(&sample_chunk(3, 0, 10)).is_err());
        sink.begin(&layout_of(&channels, &train)).unwrap();
        assert!(sink.chunk(&sample_chunk(2, 0, 10)).is_err());
    }

    /// A full disk is an error that names the file (Linux offers one: /dev/full; a write to it fails with ENOSPC).
    #[test]
    #[cfg(target_os = "linux")]
    fn full_disk_is_an_error() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("channels.parquet");
        let train = sample_train();
        let channels = channels(3);
        let mut sink = ParquetSink::create(&path).unwrap();
        std::fs::remove_file(&sink.partial).unwrap();
        std::os::unix::fs::symlink("/dev/full", &sink.partial).unwrap();
        let result = sink
            .begin(&layout_of(&channels, &train))
            .and_then(|()| sink.chunk(&sample_chunk(3, 0, 5000)))
            .and_then(|()| sink.finish());
        match result {
            Err(Error::Io { path: p, source }) => {
                assert_eq!(p, path);
                assert_eq!(source.kind(), std::io::ErrorKind::StorageFull, "{source}");
            }
            other => panic!("{other:?}"),
        }
        drop(sink);
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
    }
}
