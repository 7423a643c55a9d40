//! Reading `channels.parquet` back: what is in it, whether all of it can be read, and its columns.

use super::parquet::{EVENTS, PANDAS};
use crate::config::file::{nearest, regular};
use crate::error::{Error, wrong};
use crate::guarded::decoded;
use arrow_array::{Array, Float64Array};
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Contents of a file of channels.
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

/// Columns by name, as long as the file; NaN = no value in this row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Columns {
    file: PathBuf,
    by_name: BTreeMap<String, Vec<f64>>,
}

impl Columns {
    /// The column of this name. The error for a missing one has the nearest name.
    pub fn get(&self, name: &str) -> Result<&[f64], Error> {
        self.find(name).ok_or_else(|| {
            let near = nearest(name, self.names());
            let help = match near {
                Some(near) => format!("did you mean `{near}`?"),
                None => "the names of the columns are in the file's schema".to_owned(),
            };
            wrong(
                &self.file,
                None,
                format!("the file has no column `{name}`"),
                help,
            )
        })
    }

    /// The column of this name, if there is one: for what only some runs have.
    pub fn find(&self, name: &str) -> Option<&[f64]> {
        self.by_name.get(name).map(Vec::as_slice)
    }

    /// The names of the columns.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.by_name.keys().map(String::as_str)
    }
}

/// Reads every value of a file of channels; an incomplete file, or a file of another program, is an error.
pub fn read(path: &Path) -> Result<Contents, Error> {
    decoded(|| read_all(path)).unwrap_or_else(|e| Err(broken(path, e)))
}

fn read_all(path: &Path) -> Result<Contents, Error> {
    let (mut contents, reader) = open(path)?;
    for batch in reader.build().map_err(|e| broken(path, e))? {
        contents.rows += batch.map_err(|e| broken(path, e))?.num_rows();
    }
    Ok(contents)
}

/// Reads the columns whose name `wanted` accepts, and always `time`.
pub fn columns(path: &Path, wanted: impl Fn(&str) -> bool) -> Result<(Contents, Columns), Error> {
    decoded(|| read_columns(path, wanted)).unwrap_or_else(|e| Err(broken(path, e)))
}

fn read_columns(path: &Path, wanted: impl Fn(&str) -> bool) -> Result<(Contents, Columns), Error> {
    let (mut contents, reader) = open(path)?;
    let names = contents.columns.iter().enumerate();
    let chosen = names.filter(|(i, name)| *i == 0 || wanted(name));
    let mask = ProjectionMask::roots(reader.parquet_schema(), chosen.map(|(i, _)| i));
    let batches = reader.with_projection(mask).build();
    let mut columns = Columns {
        file: path.into(),
        by_name: BTreeMap::new(),
    };
    for batch in batches.map_err(|e| broken(path, e))? {
        let batch = batch.map_err(|e| broken(path, e))?;
        contents.rows += batch.num_rows();
        if contents.rows.saturating_mul(batch.num_columns()) > MAX_VALUES {
            let message = format!(
                "its columns have more than {MAX_VALUES} values, far more than a run of monorig"
            );
            return Err(broken(path, message));
        }
        let schema = batch.schema();
        for (field, values) in schema.fields().iter().zip(batch.columns()) {
            let name = field.name();
            let Some(values) = values.as_any().downcast_ref::<Float64Array>() else {
                return Err(broken(path, format!("{name} does not hold numbers")));
            };
            let values = values.iter().map(|x| x.unwrap_or(f64::NAN));
            let column = columns.by_name.entry(name.clone()).or_default();
            column.extend(values);
        }
    }
    Ok((contents, columns))
}

/// Most columns of a run: each takes memory before a value of it is read.
const MAX_COLUMNS: usize = 4096;
/// Largest number of values that are read at once: 512 MB of them.
const MAX_VALUES: usize = 64 << 20;

/// Reads everything except the values.
fn open(path: &Path) -> Result<(Contents, ParquetRecordBatchReaderBuilder<File>), Error> {
    regular(path)?;
    let file = File::open(path).map_err(Error::at(path))?;
    let reader = ParquetRecordBatchReaderBuilder::try_new(file).map_err(|e| broken(path, e))?;
    let schema = reader.schema().clone();
    if schema.fields().len() > MAX_COLUMNS {
        let count = schema.fields().len();
        return Err(broken(
            path,
            format!("the file has {count} columns, but a run has at most {MAX_COLUMNS}"),
        ));
    }
    // what pandas leaves of it when it writes a table that it has read
    let kept = schema.metadata().get(PANDAS);
    let kept: Value = kept.map_or(Value::Null, |text| {
        serde_json::from_str(text).unwrap_or_default()
    });
    let about = |key: &str| {
        let value = schema.metadata().get(key).map(String::as_str);
        match value.or_else(|| kept[key].as_str()) {
            Some(value) => Ok(value.to_owned()),
            None => Err(broken(path, format!("the file does not give its {key}"))),
        }
    };
    let pairs = reader.metadata().file_metadata().key_value_metadata();
    let events = pairs
        .into_iter()
        .flatten()
        .find(|kv| kv.key == EVENTS)
        .and_then(|kv| kv.value.clone())
        .or_else(|| kept.get(EVENTS).map(Value::to_string))
        .ok_or_else(|| broken(path, "the file does not list its events"))?;
    let contents = Contents {
        scenario: about("scenario")?,
        seed: about("seed")?,
        columns: schema.fields().iter().map(|f| f.name().clone()).collect(),
        rows: 0,
        events: serde_json::from_str(&events).map_err(|e| broken(path, e))?,
    };
    Ok((contents, reader))
}

fn broken(path: &Path, what: impl ToString) -> Error {
    let message = format!("this file of channels cannot be read: {}", what.to_string());
    wrong(
        path,
        None,
        message,
        "make the result again with `monorig run`",
    )
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

        let (same, columns) = super::columns(&path, |name| name == "b").unwrap();
        assert_eq!(same, contents);
        assert_eq!(columns.names().collect::<Vec<_>>(), ["b", "time"]);
        assert_eq!(columns.get("time").unwrap()[39], 39.0 * 0.02);
        let told = columns.get("tme").unwrap_err().to_string();
        assert!(told.contains("did you mean `time`"), "{told}");
        let sent = &chunk.values[1];
        assert!(
            columns
                .get("b")
                .unwrap()
                .iter()
                .zip(sent)
                .all(|(a, b)| a == b || a.is_nan() && b.is_nan())
        );
        assert!(
            columns.get("b").unwrap().iter().any(|x| x.is_nan()),
            "no gap was sent"
        );

        let whole = std::fs::read(&path).unwrap();
        for keep in [0, 4, whole.len() / 2, whole.len() - 1] {
            std::fs::write(&path, &whole[..keep]).unwrap();
            assert!(matches!(read(&path), Err(Error::Input(_))), "{keep} bytes");
            let torn = super::columns(&path, |_| true);
            assert!(matches!(torn, Err(Error::Input(_))), "{keep} bytes");
        }
    }
}
