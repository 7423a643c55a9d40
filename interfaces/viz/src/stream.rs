//! Messages to a file and to a viewer: the one place where chunks get their ids.
//!
//! Rerun's own `RecordingStream` stamps chunks with the time of day and batches them on a thread. Here they are made
//! and encoded in order, on this thread, with ids that count up: the same run gives the same messages, and an error of
//! the file system reaches the caller.

use crate::frames;
use crate::live::Live;
use monorig_sim::error::Error;
use re_log_encoding::{EncodeError, Encoder, EncodingOptions};
use rerun::external::re_log_types::external::re_tuid::Tuid;
use rerun::external::re_log_types::{
    BlueprintActivationCommand, EntityPathPart, SetStoreInfo, StoreInfo, StoreSource,
};
use rerun::log::{Chunk, ChunkId, LogMsg, RowId, TimeColumn};
use rerun::{
    AsComponents, EntityPath, SerializationError, SerializedComponentBatch,
    SerializedComponentColumn, StoreId, StoreKind, TimePoint, Timeline,
};
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// Application under which the viewer files every recording of this program; one blueprint serves them all.
pub const APPLICATION: &str = "monorig";
/// Name of the only timeline.
pub const TIMELINE: &str = "sim_time";

/// The store of a recording that a message belongs to.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum RerunStore {
    /// The data.
    Recording,
    /// The layout of the viewer.
    Blueprint,
}

/// Ids of the two stores.
struct Ids([StoreId; 2]);

impl Ids {
    fn new(recording: &str) -> Self {
        let layout = format!("{recording}-layout");
        Self([
            StoreId::new(StoreKind::Recording, APPLICATION, recording),
            StoreId::new(StoreKind::Blueprint, APPLICATION, layout),
        ])
    }

    fn of(&self, store: RerunStore) -> StoreId {
        self.0[store as usize].clone()
    }
}

/// An entity and its components that hold at all times.
type Fixed = (EntityPath, Vec<SerializedComponentBatch>);

/// A file being written, and perhaps a viewer.
pub struct MessageStream {
    path: PathBuf,
    encoder: Encoder<BufWriter<File>>,
    file_ids: Ids,
    live: Option<(Live, Ids)>,
    /// Entities given before the first columns. They are encoded with these, when the run goes on already; a viewer
    /// gets them at once.
    waiting: Vec<Fixed>,
    next_id: u64,
    finished: bool,
}

impl MessageStream {
    /// Create the file. `recording`: the recording's id.
    ///
    /// A viewer never shows two recordings with one id apart, so for it a second run of the same scenario and seed
    /// must have another id: the time of day is added, there only.
    pub fn create(path: &Path, recording: &str, live: Option<Live>) -> Result<Self, Error> {
        let file = File::create(path).map_err(|e| io(path, e))?;
        let file_ids = Ids::new(recording);
        let version = info(file_ids.of(RerunStore::Recording)).store_version;
        let version = version.ok_or_else(|| io(path, std::io::Error::other("no version")))?;
        let encoder = Encoder::new_eager(
            version,
            EncodingOptions::PROTOBUF_COMPRESSED,
            BufWriter::new(file),
        )
        .map_err(|e| encode(path, e))?;
        let live = live.map(|l| (l, Ids::new(&format!("{recording}-{}", now_ms()))));
        let mut stream = Self {
            path: path.into(),
            encoder,
            file_ids,
            live,
            waiting: Vec::new(),
            next_id: 1,
            finished: false,
        };
        stream.begin_store(RerunStore::Recording)?;
        Ok(stream)
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The viewer, if there is one.
    pub fn live(&self) -> Option<&Live> {
        self.live.as_ref().map(|(live, _)| live)
    }

    /// Something that holds at all times.
    pub fn fixed(&mut self, entity: EntityPath, what: &dyn AsComponents) -> Result<(), Error> {
        self.all_fixed(entity, &[what])
    }

    /// Several things of one entity that hold at all times.
    pub fn all_fixed(
        &mut self,
        entity: EntityPath,
        all: &[&dyn AsComponents],
    ) -> Result<(), Error> {
        let batches = all.iter().flat_map(|what| what.as_serialized_batches());
        self.waiting.push((entity, batches.collect()));
        match &self.live {
            Some(_) => self.send_fixed(),
            None => Ok(()),
        }
    }

    /// Send what waits.
    fn send_fixed(&mut self) -> Result<(), Error> {
        for (entity, batches) in std::mem::take(&mut self.waiting) {
            self.row(RerunStore::Recording, entity, TimePoint::STATIC, batches)?;
        }
        Ok(())
    }

    /// Many rows of one entity. Lengths of times and columns must agree.
    pub fn columns(
        &mut self,
        entity: EntityPath,
        times: TimeColumn,
        columns: impl IntoIterator<Item = SerializedComponentColumn>,
    ) -> Result<(), Error> {
        self.send_fixed()?;
        let (id, _) = self.id();
        let timelines = std::iter::once((*times.timeline().name(), times)).collect();
        let chunk = Chunk::from_auto_row_ids(id, entity, timelines, columns.into_iter().collect());
        self.chunk(RerunStore::Recording, chunk)
    }

    /// The layout of the viewer: entities of the blueprint store, in order.
    pub fn blueprint(
        &mut self,
        entities: Vec<(EntityPath, Box<dyn AsComponents + Send>)>,
    ) -> Result<(), Error> {
        self.send_fixed()?;
        self.begin_store(RerunStore::Blueprint)?;
        for (entity, what) in entities {
            let start = TimePoint::from([(Timeline::new_sequence("blueprint"), 0)]);
            let batches = what.as_serialized_batches();
            self.row(RerunStore::Blueprint, entity, start, batches)?;
        }
        self.send(&|ids| {
            LogMsg::BlueprintActivationCommand(BlueprintActivationCommand {
                blueprint_id: ids.of(RerunStore::Blueprint),
                make_active: true,
                make_default: true,
            })
        })
    }

    /// Close the file, so that it can be read without repair, and wait a little for the viewer.
    pub fn finish(&mut self) -> Result<(), Error> {
        let closed = match std::mem::replace(&mut self.finished, true) {
            true => Ok(()),
            false => self.send_fixed().and_then(|()| self.close()),
        };
        if let Some((live, _)) = &mut self.live {
            live.finish();
        }
        closed
    }

    fn close(&mut self) -> Result<(), Error> {
        let closed = self.encoder.finish();
        closed
            .and_then(|()| self.encoder.flush_blocking())
            .map_err(|e| encode(&self.path, e))?;
        frames::sort_index(&self.path).map_err(|e| io(&self.path, e))
    }

    fn row(
        &mut self,
        store: RerunStore,
        entity: EntityPath,
        time: TimePoint,
        what: Vec<SerializedComponentBatch>,
    ) -> Result<(), Error> {
        let (id, row) = self.id();
        let chunk = Chunk::builder_with_id(id, entity)
            .with_serialized_batches(row, time, what)
            .build();
        self.chunk(store, chunk)
    }

    fn chunk(
        &mut self,
        store: RerunStore,
        chunk: rerun::log::ChunkResult<Chunk>,
    ) -> Result<(), Error> {
        let arrow = chunk
            .and_then(|c| c.to_arrow_msg())
            .map_err(|e| io(&self.path, std::io::Error::other(e)))?;
        self.send(&|ids| LogMsg::ArrowMsg(ids.of(store), arrow.clone()))
    }

    fn begin_store(&mut self, store: RerunStore) -> Result<(), Error> {
        let row_id = Tuid::from_u128(u128::from(self.next_id) << 64);
        self.next_id += 1;
        self.send(&|ids| {
            LogMsg::SetStoreInfo(SetStoreInfo {
                row_id,
                info: info(ids.of(store)),
            })
        })
    }

    /// The message for the file's ids, and for the viewer's. (Arrow data is shared, not copied.)
    fn send(&mut self, message: &dyn Fn(&Ids) -> LogMsg) -> Result<(), Error> {
        if let Some((live, ids)) = &mut self.live {
            live.send(message(ids));
        }
        match self.encoder.append(&message(&self.file_ids)) {
            Ok(_) => Ok(()),
            Err(e) => Err(encode(&self.path, e)),
        }
    }

    /// Upper half: a number that counts up. Lower half: 0 the chunk, 1… its rows.
    fn id(&mut self) -> (ChunkId, RowId) {
        let id = ChunkId::from_u128(u128::from(self.next_id) << 64);
        self.next_id += 1;
        (id, RowId::from_tuid(id.as_tuid().next()))
    }
}

impl Drop for MessageStream {
    fn drop(&mut self) {
        // Not finished: an error or an interrupt. There is no one to return another one to.
        let _ = self.finish();
    }
}

/// An entity path from parts that may hold any character.
pub fn entity<'a>(parts: impl IntoIterator<Item = &'a str>) -> EntityPath {
    parts.into_iter().map(EntityPathPart::new).collect()
}

/// The times of many rows, which must not decrease.
pub fn times(ns: Vec<i64>) -> TimeColumn {
    TimeColumn::new(None, Timeline::new_duration(TIMELINE), ns.into())
}

/// Columns, or the error of a library, to the stream.
pub fn send<I: IntoIterator<Item = SerializedComponentColumn>>(
    stream: &mut MessageStream,
    entity: EntityPath,
    times: TimeColumn,
    columns: Result<I, SerializationError>,
) -> Result<(), Error> {
    let columns = columns.map_err(|e| io(stream.path(), std::io::Error::other(e)))?;
    stream.columns(entity, times, columns)
}

fn info(id: StoreId) -> StoreInfo {
    StoreInfo::new(id, StoreSource::Other(APPLICATION.into()))
}

fn now_ms() -> u128 {
    std::time::SystemTime::now()
        .duration_since(std::time::UNIX_EPOCH)
        .map_or(0, |d| d.as_millis())
}

fn encode(path: &Path, e: EncodeError) -> Error {
    match e {
        EncodeError::Write(source) => io(path, source),
        other => io(path, std::io::Error::other(other)),
    }
}

fn io(path: &Path, source: std::io::Error) -> Error {
    Error::at(path)(source)
}
