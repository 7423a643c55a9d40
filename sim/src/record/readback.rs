//! Reading `channels.parquet` back: what is in it, and whether all of it can be read.

use super::parquet::EVENTS;
use crate::error::{Error, InputError};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use std::fs::File;
use std::path::Path;

/// What a file of channels holds.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Contents {
    /// Scenario name.
    pub scenario: String,
    /// Seed, as written.
    pub seed: String,
    /// Columns, `time` first.
    pub columns: Vec<String>,
    /// Rows.
    pub rows: usize,
    /// Events: time in ns and text.
    pub events: Vec<(i64, String)>,
}

/// Read every value of a file of channels. One that breaks off, or is not ours, is an error.
pub fn read(path: &Path) -> Result<Contents, Error> {
    let broken = |what: String| -> Error {
        InputError {
            file: path.into(),
            line: None,
            column: None,
            key: String::new(),
            message: format!("this file of channels cannot be read: {what}"),
            help: "make it again with `monorig run`".into(),
        }
        .into()
    };
    let file = File::open(path).map_err(|source| Error::Io {
        path: path.into(),
        source,
    })?;
    let reader =
        ParquetRecordBatchReaderBuilder::try_new(file).map_err(|e| broken(e.to_string()))?;
    let schema = reader.schema().clone();
    let about = |key: &str| match schema.metadata().get(key) {
        Some(value) => Ok(value.clone()),
        None => Err(broken(format!("it does not name its {key}"))),
    };
    let pairs = reader.metadata().file_metadata().key_value_metadata();
    let events = pairs
        .into_iter()
        .flatten()
        .find(|kv| kv.key == EVENTS)
        .and_then(|kv| kv.value.as_deref())
        .ok_or_else(|| broken("it does not tell its events".into()))?;
    let mut contents = Contents {
        scenario: about("scenario")?,
        seed: about("seed")?,
        columns: schema.fields().iter().map(|f| f.name().clone()).collect(),
        rows: 0,
        events: serde_json::from_str(events).map_err(|e| broken(e.to_string()))?,
    };
    for batch in reader.build().map_err(|e| broken(e.to_string()))? {
        contents.rows += batch.map_err(|e| broken(e.to_string()))?.num_rows();
    }
    Ok(contents)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::parquet::ParquetSink;
    use crate::record::testing::{layout_of, sample_chunk, sample_train};
    use crate::record::{Channel, Sink};

    #[test]
    fn what_was_recorded_is_counted_and_a_torn_file_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("channels.parquet");
        let channels: Vec<Channel> = ["a", "b"]
            .map(|name| Channel {
                path: name.into(),
                unit: "m",
            })
            .into();
        let train = sample_train();
        let chunk = sample_chunk(2, 0, 40);
        let mut sink = ParquetSink::create(&path).unwrap();
        sink.begin(&layout_of(&channels, &train)).unwrap();
        sink.chunk(&chunk).unwrap();
        sink.finish().unwrap();

        let contents = read(&path).unwrap();
        assert_eq!(contents.columns, ["time", "a", "b"]);
        assert_eq!((contents.rows, contents.seed.as_str()), (40, "7"));
        assert_eq!(contents.events, chunk.events);

        let whole = std::fs::read(&path).unwrap();
        for keep in [0, 4, whole.len() / 2, whole.len() - 1] {
            std::fs::write(&path, &whole[..keep]).unwrap();
            assert!(matches!(read(&path), Err(Error::Input(_))), "{keep} bytes");
        }
    }
}
