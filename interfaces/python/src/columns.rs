//! The channels and poses of a run in memory: as Arrow, and handed on to any sink.

use arrow_array::{ArrayRef, Float64Array, RecordBatch};
use arrow_schema::SchemaRef;
use monorig_sim::error::Error;
use monorig_sim::rail::RailFrame;
use monorig_sim::record::parquet::{column, schema};
use monorig_sim::record::{Channel, Chunk, Emphasis, Layout, MarkedStretch, MarkedTime, Sink};
use monorig_sim::train::Train;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A box beside the rail: pose and size.
type Obstacle = (nalgebra::Isometry3<f64>, nalgebra::Vector3<f64>);

/// A sink that keeps what was recorded; its clones share it.
#[derive(Clone, Default)]
pub(crate) struct Columns(Arc<Mutex<Kept>>);

/// The layout and the chunks recorded so far.
#[derive(Default)]
pub(crate) struct Kept {
    schema: Option<SchemaRef>,
    scenario: String,
    seed: u64,
    why: String,
    channels: Vec<Channel>,
    train: Train,
    rail: Vec<RailFrame>,
    profile: Vec<[f64; 2]>,
    obstacles: Vec<Obstacle>,
    zones: Vec<MarkedStretch>,
    in_loop: Option<String>,
    references: Vec<String>,
    faults: Vec<MarkedTime>,
    recorded: bool,
    chunks: Vec<Chunk>,
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
    fn begin(&mut self, of: &Layout<'_>) -> Result<(), Error> {
        *self.kept() = Kept {
            schema: Some(schema(of)),
            scenario: of.scenario.to_owned(),
            seed: of.seed,
            why: of.why.to_owned(),
            channels: of.channels.to_vec(),
            train: of.train.clone(),
            rail: of.rail.to_vec(),
            profile: of.profile.to_vec(),
            obstacles: of.obstacles.to_vec(),
            zones: of.zones.to_vec(),
            in_loop: of.emphasis.in_loop.map(str::to_owned),
            references: of.emphasis.references.iter().map(|&r| r.into()).collect(),
            faults: of.emphasis.faults.to_vec(),
            recorded: of.emphasis.recorded,
            chunks: Vec::new(),
        };
        Ok(())
    }

    fn chunk(&mut self, chunk: &Chunk) -> Result<(), Error> {
        self.kept().chunks.push(chunk.clone());
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
        let times = self.chunks.iter().flat_map(|c| &c.time_ns);
        let seconds = times.map(|&ns| ns as f64 * 1e-9);
        let time: ArrayRef = Arc::new(Float64Array::from_iter_values(seconds));
        let of_channel = |i: usize| {
            let parts = self.chunks.iter().filter_map(|c| c.values.get(i));
            column(&parts.flatten().copied().collect::<Vec<f64>>())
        };
        let values = (0..self.channels.len()).map(of_channel);
        let columns = std::iter::once(time).chain(values).collect();
        RecordBatch::try_new(schema.clone(), columns).map_err(|e| e.to_string())
    }

    /// Events: time in ns and text.
    pub(crate) fn events(&self) -> Vec<(i64, String)> {
        self.chunks.iter().flat_map(|c| c.events.clone()).collect()
    }

    /// Hands all of it to a sink, chunk by chunk as the recorder did.
    pub(crate) fn write(&self, sink: &mut dyn Sink) -> Result<(), Error> {
        let references: Vec<&str> = self.references.iter().map(String::as_str).collect();
        sink.begin(&Layout {
            scenario: &self.scenario,
            seed: self.seed,
            why: &self.why,
            channels: &self.channels,
            train: &self.train,
            rail: &self.rail,
            profile: &self.profile,
            obstacles: &self.obstacles,
            zones: &self.zones,
            emphasis: Emphasis {
                in_loop: self.in_loop.as_deref(),
                references: &references,
                faults: &self.faults,
                recorded: self.recorded,
            },
        })?;
        self.chunks.iter().try_for_each(|chunk| sink.chunk(chunk))?;
        sink.finish()
    }
}
