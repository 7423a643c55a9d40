//! What changes: a chunk of the run, entity by entity.

use crate::gaps::GapFinder;
use crate::lanes::ValidityLanes;
use crate::origin::Origin;
use crate::readout::Readout;
use crate::scene::{WheelShape, body_entity};
use crate::series::{PlottedSeries, plan};
use crate::source::ScalarSource;
use crate::stream::{MessageStream, entity, times};
use crate::thinning::{Periods, thin};
use monorig_sim::error::Error;
use monorig_sim::record::{Chunk, Layout};
use monorig_sim::train::ConnectionKind;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use re_sdk_types::archetypes::{LineStrips3D, Points2D, Points3D, Scalars, TextLog, Transform3D};
use re_sdk_types::components::Color;
use rerun::log::TimeColumn;
use rerun::{EntityPath, SerializationError, SerializedComponentColumn};

const LINK: [u8; 3] = [200, 200, 210];
/// m.
const LINK_RADIUS: f32 = 0.015;
const TRAIN_MARK: [u8; 3] = [255, 220, 60];
const EVENT_MARK: [u8; 3] = [255, 110, 90];
/// Pixels.
const MARK_RADIUS: f32 = 6.0;
/// Place of the label of an event above the body the camera follows, m.
const EVENT_ABOVE_M: f64 = 1.2;

/// Where the columns of a chunk go.
pub struct ChunkColumns {
    series: Vec<PlottedSeries>,
    gaps: Vec<GapFinder>,
    lanes: ValidityLanes,
    readout: Readout,
    origin: Origin,
    bodies: Vec<EntityPath>,
    wheels: Vec<WheelShape>,
    links: Vec<Link>,
    /// Index of the body the camera follows.
    followed: usize,
    /// Thins the lines of what is not sampled; none: they go through each row.
    periods: Option<Periods>,
}

/// Rows of a chunk, of which a line is drawn through some.
struct Rows {
    /// The first of each period, if the line is thinned.
    first: Option<Vec<bool>>,
    /// Times of these, or of all.
    times: TimeColumn,
}

impl Rows {
    fn all(chunk: &Chunk) -> Self {
        Self {
            first: None,
            times: times(chunk.time_ns.clone()),
        }
    }

    fn thinned(chunk: &Chunk, periods: &mut Periods) -> Self {
        let first = periods.first_rows(&chunk.time_ns);
        let kept = chunk
            .time_ns
            .iter()
            .zip(&first)
            .filter(|(_, first)| **first);
        Self {
            times: times(kept.map(|(ns, _)| *ns).collect()),
            first: Some(first),
        }
    }
}

/// A frame that moves with the train: origin at the followed body, x along its heading, z up. For the camera.
pub fn follow_entity() -> EntityPath {
    entity(["world", "follow"])
}

/// A line between two bodies.
struct Link {
    entity: EntityPath,
    bodies: [usize; 2],
    anchors: [Vector3<f64>; 2],
}

impl ChunkColumns {
    /// Styles are logged here; `wheels` as they came from the scene.
    pub fn begin(
        stream: &mut MessageStream,
        layout: &Layout<'_>,
        wheels: Vec<WheelShape>,
        origin: Origin,
        periods: Option<Periods>,
    ) -> Result<Self, Error> {
        let series = plan(layout.channels);
        for s in &series {
            stream.fixed(s.entity.clone(), &s.style())?;
        }
        let links = links(layout);
        for link in &links {
            let [r, g, b] = LINK;
            let style = LineStrips3D::update_fields()
                .with_colors([Color::from_rgb(r, g, b)])
                .with_radii([LINK_RADIUS]);
            stream.fixed(link.entity.clone(), &style)?;
        }
        marks(stream)?;
        let bodies = layout.train.bodies.iter();
        Ok(Self {
            gaps: series
                .iter()
                .map(|s| GapFinder::new(s.is_sampled()))
                .collect(),
            lanes: ValidityLanes::begin(stream, layout.channels)?,
            readout: Readout::new(layout.channels),
            origin,
            series,
            bodies: bodies.map(|b| body_entity(&b.name)).collect(),
            wheels,
            links,
            followed: layout.train.load.unwrap_or(layout.train.bodies.len() / 2),
            periods,
        })
    }

    /// All lines, for the layout of the viewer.
    pub fn series(&self) -> &[PlottedSeries] {
        &self.series
    }

    /// Names of the estimators whose validity is recorded.
    pub fn estimators(&self) -> &[String] {
        self.lanes.estimators()
    }

    /// Some seconds of the run.
    pub fn log(&mut self, stream: &mut MessageStream, chunk: &Chunk) -> Result<(), Error> {
        let all = Rows::all(chunk);
        let periods = self.periods.as_mut();
        let thinned = periods.map(|periods| Rows::thinned(chunk, periods));
        for (s, gaps) in self.series.iter().zip(&mut self.gaps) {
            // a sample stands in one row only
            let rows = thinned.as_ref().filter(|_| !s.is_sampled());
            scalars(stream, s, gaps, chunk, rows.unwrap_or(&all))?;
        }
        self.lanes.log(stream, chunk)?;
        self.readout.log(stream, chunk)?;
        let pose_times = times(chunk.pose_time_ns.clone());
        self.poses(stream, chunk, &pose_times)?;
        self.wheels(stream, chunk, &pose_times)?;
        self.links(stream, chunk, &pose_times)?;
        self.follow(stream, chunk, &pose_times)?;
        self.events(stream, chunk)
    }

    /// The log of events, and each as a label where the train was.
    fn events(&self, stream: &mut MessageStream, chunk: &Chunk) -> Result<(), Error> {
        if chunk.events.is_empty() {
            return Ok(());
        }
        let (ns, texts): (Vec<i64>, Vec<&str>) =
            chunk.events.iter().map(|(t, s)| (*t, s.as_str())).unzip();
        let log = TextLog::update_fields()
            .with_many_level(vec!["INFO"; texts.len()])
            .with_many_text(texts.clone());
        let columns = log.columns_of_unit_batches();
        send(stream, entity(["events"]), times(ns.clone()), columns)?;
        let Some(poses) = chunk.poses.get(self.followed).filter(|p| !p.is_empty()) else {
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

    fn poses(
        &self,
        stream: &mut MessageStream,
        chunk: &Chunk,
        pose_times: &TimeColumn,
    ) -> Result<(), Error> {
        for (body, poses) in self.bodies.iter().zip(&chunk.poses) {
            if poses.is_empty() {
                continue;
            }
            let columns = Transform3D::update_fields()
                .with_many_translation(
                    poses
                        .iter()
                        .map(|(p, _)| self.origin.point(&Vector3::from(*p))),
                )
                .with_many_quaternion(poses.iter().map(|(_, q)| xyzw(*q)))
                .columns_of_unit_batches();
            send(stream, body.clone(), pose_times.clone(), columns)?;
        }
        Ok(())
    }

    fn follow(
        &self,
        stream: &mut MessageStream,
        chunk: &Chunk,
        pose_times: &TimeColumn,
    ) -> Result<(), Error> {
        let Some(poses) = chunk.poses.get(self.followed).filter(|p| !p.is_empty()) else {
            return Ok(());
        };
        let upright = |pose: &([f64; 3], [f64; 4])| {
            let ahead = isometry(pose).rotation * Vector3::x();
            let half = ahead.y.atan2(ahead.x) / 2.0;
            xyzw([0.0, 0.0, half.sin(), half.cos()])
        };
        let columns = Transform3D::update_fields()
            .with_many_translation(
                poses
                    .iter()
                    .map(|(p, _)| self.origin.point(&Vector3::from(*p))),
            )
            .with_many_quaternion(poses.iter().map(upright))
            .columns_of_unit_batches();
        send(stream, follow_entity(), pose_times.clone(), columns)?;
        let on_plan = poses.iter().map(|(p, _)| plan_point(&self.origin, p));
        let columns = Points2D::update_fields()
            .with_positions(on_plan)
            .columns_of_unit_batches();
        send(
            stream,
            entity(["plan", "train"]),
            pose_times.clone(),
            columns,
        )
    }

    fn wheels(
        &self,
        stream: &mut MessageStream,
        chunk: &Chunk,
        pose_times: &TimeColumn,
    ) -> Result<(), Error> {
        for wheel in &self.wheels {
            let (drive, side) = wheel.spins;
            let Some(angles) = chunk.wheel_angles.get(drive).filter(|a| !a.is_empty()) else {
                continue;
            };
            let about_z = |angle: f64| [0.0, 0.0, (angle / 2.0).sin(), (angle / 2.0).cos()];
            let angle = |pair: &[f64; 2]| pair[side.min(1)];
            let columns = Transform3D::update_fields()
                .with_many_quaternion(angles.iter().map(|a| xyzw(about_z(angle(a)))))
                .columns_of_unit_batches();
            send(stream, wheel.entity.clone(), pose_times.clone(), columns)?;
        }
        Ok(())
    }

    fn links(
        &self,
        stream: &mut MessageStream,
        chunk: &Chunk,
        pose_times: &TimeColumn,
    ) -> Result<(), Error> {
        for link in &self.links {
            let [a, b] = link.bodies;
            let (Some(a), Some(b)) = (chunk.poses.get(a), chunk.poses.get(b)) else {
                continue;
            };
            if a.is_empty() {
                continue;
            }
            let end = |pose: &([f64; 3], [f64; 4]), k: usize| {
                let end = isometry(pose) * nalgebra::Point3::from(link.anchors[k]);
                self.origin.point(&end.coords)
            };
            let strips = a.iter().zip(b).map(|(a, b)| vec![end(a, 0), end(b, 1)]);
            let columns = LineStrips3D::new(strips).columns_of_unit_batches();
            send(stream, link.entity.clone(), pose_times.clone(), columns)?;
        }
        Ok(())
    }
}

/// Rows without a finite value are left out, but for the first of a gap: that one is not a number, and the line breaks there.
fn scalars(
    stream: &mut MessageStream,
    series: &PlottedSeries,
    gaps: &mut GapFinder,
    chunk: &Chunk,
    of: &Rows,
) -> Result<(), Error> {
    let (rows, width) = (chunk.time_ns.len(), series.line.width());
    if let ScalarSource::Limit(limit) = series.line {
        let mut ends: Vec<i64> = [chunk.time_ns.first(), chunk.time_ns.last()]
            .into_iter()
            .flatten()
            .copied()
            .collect();
        ends.dedup();
        let columns = Scalars::new(vec![limit; ends.len()]).columns_of_unit_batches();
        return send(stream, series.entity.clone(), times(ends), columns);
    }
    let mut values = series.line.scalars(&chunk.values, rows);
    let mut written = Vec::new();
    for (row, &ns) in values.chunks_exact_mut(width).zip(&chunk.time_ns) {
        let whole = row.iter().all(|x| x.is_finite());
        if !whole {
            row.fill(f64::NAN);
        }
        written.push(gaps.keeps(ns, whole));
    }
    if let Some(first) = &of.first {
        thin(&values, width, first, &mut written);
    }
    let row_times = if of.first.is_none() && written.iter().all(|&w| w) {
        of.times.clone()
    } else {
        let kept = values
            .chunks_exact(width)
            .zip(&written)
            .filter(|(_, w)| **w);
        let ns = chunk.time_ns.iter().zip(&written).filter(|(_, w)| **w);
        let ns: Vec<i64> = ns.map(|(t, _)| *t).collect();
        values = kept.flat_map(|(v, _)| v.iter().copied()).collect();
        match of.first.as_ref() == Some(&written) {
            true => of.times.clone(),
            false => times(ns),
        }
    };
    if values.is_empty() {
        return Ok(());
    }
    let rows = values.len() / width;
    let columns = Scalars::new(values).columns(std::iter::repeat_n(width, rows));
    send(stream, series.entity.clone(), row_times, columns)
}

/// A place in the world on the plan: the viewer's second axis points down.
pub fn plan_point(origin: &Origin, place: &[f64; 3]) -> [f32; 2] {
    let [x, y, _] = origin.point(&Vector3::from(*place));
    [x, -y]
}

/// How the marks that move look: the train on the plan, and the latest event.
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

/// Drawbars and chains; a hanger holds its anchors together, so there is nothing to draw.
fn links(layout: &Layout<'_>) -> Vec<Link> {
    let connections = layout.train.connections.iter().enumerate();
    let drawn = connections.filter(|(_, c)| c.kind != ConnectionKind::Hanger);
    drawn
        .map(|(i, c)| Link {
            entity: entity([
                "world",
                "links",
                &match c.kind {
                    ConnectionKind::Chain => format!("chain_{i}"),
                    _ => format!("drawbar_{i}"),
                },
            ]),
            bodies: [c.a, c.b],
            anchors: [c.anchor_a, c.anchor_b],
        })
        .collect()
}

/// Columns, or the error of a library, to the stream.
pub fn send<I: IntoIterator<Item = SerializedComponentColumn>>(
    stream: &mut MessageStream,
    entity: EntityPath,
    times: TimeColumn,
    columns: Result<I, SerializationError>,
) -> Result<(), Error> {
    let columns = columns.map_err(|e| Error::Io {
        path: stream.path().into(),
        source: std::io::Error::other(e),
    })?;
    stream.columns(entity, times, columns)
}

fn xyzw(q: [f64; 4]) -> re_sdk_types::datatypes::Quaternion {
    re_sdk_types::datatypes::Quaternion::from_xyzw(q.map(|x| x as f32))
}

/// Position and quaternion xyzw as a transformation.
pub fn isometry((p, q): &([f64; 3], [f64; 4])) -> Isometry3<f64> {
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(q[3], q[0], q[1], q[2]));
    Isometry3::from_parts(Translation3::from(*p), rotation)
}
