//! The rows of a chunk of the run, entity by entity.

use crate::acting::ActingLanes;
use crate::lanes::ValidityLanes;
use crate::lines::PlottedLines;
use crate::motion::MovingBodies;
use crate::origin::Origin;
use crate::readout::Readout;
use crate::scene::WheelShape;
use crate::series::PlottedSeries;
use crate::stream::{MessageStream, entity, send, times};
use monorig_sim::error::Error;
use monorig_sim::record::{Chunk, Layout};
use nalgebra::Vector3;
use re_sdk_types::archetypes::{Points2D, Points3D, TextLog};
use re_sdk_types::components::Color;
use rerun::EntityPath;

const TRAIN_MARK: [u8; 3] = [255, 220, 60];
const EVENT_MARK: [u8; 3] = [255, 110, 90];
/// Pixels.
const MARK_RADIUS: f32 = 6.0;
/// Place of the label of an event above the body the camera follows, m.
const EVENT_ABOVE_M: f64 = 1.2;

/// Destinations of the columns of a chunk.
pub struct ChunkColumns {
    lines: PlottedLines,
    lanes: ValidityLanes,
    acting: ActingLanes,
    readout: Readout,
    bodies: MovingBodies,
    origin: Origin,
}

impl ChunkColumns {
    /// Styles are logged here; `wheels` as they came from the scene. Lines that are not thinned go through all rows.
    pub fn begin(
        stream: &mut MessageStream,
        layout: &Layout<'_>,
        wheels: Vec<WheelShape>,
        origin: Origin,
        thinned: bool,
    ) -> Result<Self, Error> {
        let lines = PlottedLines::begin(stream, layout, thinned)?;
        let bodies = MovingBodies::begin(stream, layout, wheels, origin)?;
        marks(stream)?;
        Ok(Self {
            lines,
            lanes: ValidityLanes::begin(stream, layout)?,
            acting: ActingLanes::begin(stream, layout)?,
            readout: Readout::new(layout.channels, layout.emphasis.recorded),
            bodies,
            origin,
        })
    }

    /// All lines, for the layout of the viewer.
    pub fn series(&self) -> &[PlottedSeries] {
        self.lines.series()
    }

    /// The largest value of each line so far, without its sign.
    pub fn largest(&self) -> Vec<f64> {
        self.lines.largest()
    }

    /// The estimators whose validity is recorded.
    pub fn lanes(&self) -> &ValidityLanes {
        &self.lanes
    }

    /// Entities of the lanes of what acts.
    pub fn acting(&self) -> Vec<EntityPath> {
        self.acting.entities()
    }

    /// Some seconds of the run. Of lines and poses what is not enough for a message waits.
    pub fn log(&mut self, stream: &mut MessageStream, chunk: &Chunk) -> Result<(), Error> {
        self.lines.log(stream, chunk)?;
        let changes = self.lanes.log(stream, chunk)?;
        self.acting.log(stream, chunk)?;
        self.readout.log(stream, chunk)?;
        self.bodies.log(stream, chunk)?;
        log_events(stream, &chunk.events, &changes)?;
        self.mark_events(stream, chunk)
    }

    /// Send what waits.
    pub fn flush(&mut self, stream: &mut MessageStream) -> Result<(), Error> {
        self.lines.flush(stream)?;
        self.bodies.flush(stream)
    }

    /// Each event as a label where the train was.
    fn mark_events(&self, stream: &mut MessageStream, chunk: &Chunk) -> Result<(), Error> {
        if chunk.events.is_empty() {
            return Ok(());
        }
        let (ns, texts): (Vec<i64>, Vec<&str>) =
            chunk.events.iter().map(|(t, s)| (*t, s.as_str())).unzip();
        let Some(poses) = self.bodies.followed(chunk) else {
            return Ok(());
        };
        let place = |t: &i64| {
            let next = chunk.pose_time_ns.partition_point(|p| p < t);
            let (p, _) = poses[next.min(poses.len() - 1)];
            self.origin
                .point(&(Vector3::from(p) + EVENT_ABOVE_M * Vector3::z()))
        };
        let marks = Points3D::update_fields()
            .with_positions(ns.iter().map(place))
            .with_labels(texts);
        let columns = marks.columns_of_unit_batches();
        send(stream, entity(["world", "event"]), times(ns), columns)
    }
}

/// Sends the log of what happened and of what became valid, each with its time in front.
fn log_events(
    stream: &mut MessageStream,
    happened: &[(i64, String)],
    changes: &[(i64, String)],
) -> Result<(), Error> {
    let level = |level: &'static str| move |(t, text): &(i64, String)| (*t, level, text.clone());
    let happened = happened.iter().map(level("INFO"));
    let changes = changes.iter().map(level("DEBUG"));
    let mut all: Vec<(i64, &str, String)> = happened.chain(changes).collect();
    if all.is_empty() {
        return Ok(());
    }
    all.sort_by_key(|event| event.0);
    let text = |(t, _, text): &(i64, &str, String)| format!("{:.1} s: {text}", *t as f64 * 1e-9);
    let texts: Vec<String> = all.iter().map(text).collect();
    let log = TextLog::update_fields()
        .with_many_level(all.iter().map(|event| event.1))
        .with_many_text(texts);
    let columns = log.columns_of_unit_batches();
    let ns = all.iter().map(|event| event.0).collect();
    send(stream, entity(["events"]), times(ns), columns)
}

/// Sends the looks of the marks that move: the train on the plan, and the latest event.
fn marks(stream: &mut MessageStream) -> Result<(), Error> {
    let radius = re_sdk_types::components::Radius::new_ui_points(MARK_RADIUS);
    let colour = |[r, g, b]: [u8; 3]| Color::from_rgb(r, g, b);
    let train = Points2D::update_fields()
        .with_colors([colour(TRAIN_MARK)])
        .with_radii([radius]);
    stream.fixed(entity(["plan", "train"]), &train)?;
    let event = Points3D::update_fields()
        .with_colors([colour(EVENT_MARK)])
        .with_radii([radius]);
    stream.fixed(entity(["world", "event"]), &event)
}
