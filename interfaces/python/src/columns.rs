//! The channels of a run in memory, as Arrow.

use arrow_array::{ArrayRef, Float64Array, RecordBatch};
use arrow_schema::SchemaRef;
use monorig_sim::error::Error;
use monorig_sim::record::parquet::{ParquetSink, column, schema};
use monorig_sim::record::{Channel, Chunk, Emphasis, Layout, Sink};
use monorig_sim::train::Train;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A sink that keeps what was recorded; its clones share it.
#[derive(Clone, Default)]
pub(crate) struct Columns(Arc<Mutex<Kept>>);

/// The channels and events recorded so far.
#[derive(Default)]
pub(crate) struct Kept {
    schema: Option<SchemaRef>,
    channels: Vec<Channel>,
    why: String,
    /// Rows of each chunk.
    rows: Vec<usize>,
    time_ns: Vec<i64>,
    values: Vec<Vec<f64>>,
    pub(crate) events: Vec<(i64, String)>,
}

impl Columns {
    fn kept(&self) -> MutexGuard<'_, Kept> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes what was recorded out.
    pub(crate) fn take(&self) -> Kept {
        std::mem::take(&mut self.kept())
    }
}

impl Sink for Columns {
    fn begin(&mut self, layout: &Layout<'_>) -> Result<(), Error> {
        let mut kept = self.kept();
        kept.schema = Some(schema(layout));
        kept.channels = layout.channels.to_vec();
        kept.why = layout.why.to_owned();
        kept.values = vec![Vec::new(); layout.channels.len()];
        Ok(())
    }

    fn chunk(&mut self, chunk: &Chunk) -> Result<(), Error> {
        let mut kept = self.kept();
        kept.rows.push(chunk.time_ns.len());
        kept.time_ns.extend_from_slice(&chunk.time_ns);
        for (all, new) in kept.values.iter_mut().zip(&chunk.values) {
            all.extend_from_slice(new);
        }
        kept.events.extend_from_slice(&chunk.events);
        Ok(())
    }

    fn finish(&mut self) -> Result<(), Error> {
        Ok(())
    }
}

impl Kept {
    /// The columns as `channels.parquet` has them.
    pub(crate) fn batch(&self) -> Result<RecordBatch, String> {
        let Some(schema) = &self.schema else {
            return Err("the run has not begun".into());
        };
        let seconds = self.time_ns.iter().map(|&ns| ns as f64 * 1e-9);
        let time: ArrayRef = Arc::new(Float64Array::from_iter_values(seconds));
        let values = self.values.iter().map(|v| column(v));
        let columns = std::iter::once(time).chain(values).collect();
        RecordBatch::try_new(schema.clone(), columns).map_err(|e| e.to_string())
    }

    /// Writes `channels.parquet`, chunk by chunk as a recorder would have.
    pub(crate) fn write(&self, path: &Path, scenario: &str, seed: u64) -> Result<(), Error> {
        let mut sink = ParquetSink::create(path)?;
        sink.begin(&Layout {
            scenario,
            seed,
            why: &self.why,
            channels: &self.channels,
            train: &Train::default(),
            rail: &[],
            profile: &[],
            obstacles: &[],
            zones: &[],
            emphasis: Emphasis::default(),
        })?;
        let (mut from, mut events) = (0, Some(&self.events));
        for rows in &self.rows {
            let to = from + rows;
            sink.chunk(&Chunk {
                time_ns: self.time_ns.get(from..to).unwrap_or_default().to_vec(),
                values: self
                    .values
                    .iter()
                    .map(|v| v.get(from..to).unwrap_or_default().to_vec())
                    .collect(),
                events: events.take().cloned().unwrap_or_default(),
                ..Chunk::default()
            })?;
            from = to;
        }
        sink.finish()
    }
}
