//! The sink: scene, then chunks, then the end.

use crate::blueprint;
use crate::columns::ChunkColumns;
use crate::live::Live;
use crate::origin::Origin;
use crate::scene;
use crate::stream::MessageStream;
use crate::track;
use monorig_sim::error::Error;
use monorig_sim::record::{Chunk, Layout, Sink};
use re_sdk_types::archetypes::RecordingInfo;
use rerun::EntityPath;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

/// Chunks of this length suit a recording that goes to a file only, s.
pub const CHUNK_S: f64 = 30.0;
/// Length of a chunk for a recording that is watched, s; shorter chunks cost more.
pub const LIVE_CHUNK_S: f64 = 10.0;

/// Writes a `.rrd` file, and shows the run in a viewer if there is one.
///
/// The same layout and chunks give the same file, byte for byte: ids count up, no clock is read, and the index at the
/// end is put in order.
///
/// Dropped before [`Sink::finish`] (an error, an interrupt), it still closes the file.
pub struct RerunSink {
    path: PathBuf,
    live: Option<Live>,
    open: Option<Open>,
    thinned: bool,
}

/// A recording that is being written.
struct Open {
    stream: MessageStream,
    columns: ChunkColumns,
    /// The values that the layout of the viewer depends on beside the lines, until it is sent.
    to_lay_out: Option<Surroundings>,
}

/// Values that the layout depends on beside the lines.
struct Surroundings {
    vehicle_length_m: f64,
    load: bool,
    recorded: bool,
    plan: ([f32; 2], f32),
}

impl Open {
    /// Send what waits, and then the layout, if it is still to be sent.
    fn complete(&mut self) -> Result<(), Error> {
        self.columns.flush(&mut self.stream)?;
        self.lay_out()
    }

    fn lay_out(&mut self) -> Result<(), Error> {
        let Some(around) = self.to_lay_out.take() else {
            return Ok(());
        };
        let about = blueprint::Contents {
            series: self.columns.series(),
            largest: &self.columns.largest(),
            estimators: self.columns.lanes().estimators(),
            shown: self.columns.lanes().shown(),
            acting: &self.columns.acting(),
            recorded: around.recorded,
            vehicle_length_m: around.vehicle_length_m,
            load: around.load,
            plan: around.plan,
        };
        self.stream.blueprint(blueprint::entities(&about))
    }
}

impl Drop for Open {
    fn drop(&mut self) {
        // Not finished: an error. There is no one to return another one to.
        let _ = self.complete();
    }
}

impl RerunSink {
    /// A recording in a file.
    pub fn file(path: impl Into<PathBuf>) -> Self {
        Self {
            path: path.into(),
            live: None,
            open: None,
            thinned: false,
        }
    }

    /// Draw lines through about ten points a second: the smallest and the largest value of each fifth of a second, both
    /// ends of each gap, and of a stretch of equal values its ends only. Poses, states and events stay as they are.
    pub fn thinned(mut self) -> Self {
        self.thinned = true;
        self
    }

    /// A recording in a file and in the viewer at `address`. If none answers within 0.3 s the run is recorded without
    /// (see [`RerunSink::live_state`]).
    pub fn live(path: impl Into<PathBuf>, address: SocketAddr) -> Self {
        Self {
            live: Live::connect(address),
            ..Self::file(path)
        }
    }

    /// The viewer that watches; none if there is none, or it took nothing for seconds and was given up.
    pub fn live_state(&self) -> Option<&Live> {
        let open = self.open.as_ref().and_then(|o| o.stream.live());
        self.live.as_ref().or(open).filter(|live| !live.gave_up())
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Sink for RerunSink {
    fn begin(&mut self, layout: &Layout<'_>) -> Result<(), Error> {
        let id = format!("{}-{}", layout.scenario, layout.seed);
        let mut stream = MessageStream::create(&self.path, &id, self.live.take())?;
        // what the viewer calls it in its list of recordings
        let name =
            RecordingInfo::new().with_name(format!("{} seed {}", layout.scenario, layout.seed));
        stream.fixed(EntityPath::properties(), &name)?;
        let origin = Origin::of(layout);
        let wheels = scene::log(&mut stream, layout, &origin)?;
        let columns = ChunkColumns::begin(&mut stream, layout, wheels, origin, self.thinned)?;
        let around = Surroundings {
            vehicle_length_m: layout.train.limits.length_m,
            load: layout.train.load.is_some(),
            recorded: layout.emphasis.recorded,
            plan: track::plan_square(layout, &origin),
        };
        let mut open = Open {
            stream,
            columns,
            to_lay_out: Some(around),
        };
        // In a file the layout comes last: then the largest errors are known, and lanes of states show the time
        // range that is there when they are first drawn.
        if open.stream.live().is_some() {
            open.lay_out()?;
        }
        self.open = Some(open);
        Ok(())
    }

    fn chunk(&mut self, chunk: &Chunk) -> Result<(), Error> {
        let Some(open) = &mut self.open else {
            return Err(not_begun(&self.path));
        };
        open.columns.log(&mut open.stream, chunk)?;
        match open.stream.live() {
            Some(live) if !live.gave_up() => open.columns.flush(&mut open.stream),
            _ => Ok(()),
        }
    }

    fn finish(&mut self) -> Result<(), Error> {
        let Some(open) = &mut self.open else {
            return Err(not_begun(&self.path));
        };
        open.complete()?;
        open.stream.finish()
    }
}

fn not_begun(path: &Path) -> Error {
    Error::at(path)(std::io::Error::other("the recording was not started"))
}
