//! What changes: a chunk of the run, entity by entity.

use crate::scene::{WheelShape, body_entity, point};
use crate::series::{PlottedSeries, ScalarSource, plan};
use crate::stream::{MessageStream, entity, times};
use monorig_sim::error::Error;
use monorig_sim::record::{Chunk, Layout};
use monorig_sim::train::ConnectionKind;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use re_sdk_types::archetypes::{LineStrips3D, Scalars, TextLog, Transform3D};
use re_sdk_types::components::Color;
use re_sdk_types::datatypes::Quaternion as RerunQuaternion;
use rerun::log::TimeColumn;
use rerun::{EntityPath, SerializationError, SerializedComponentColumn};

const LINK: [u8; 3] = [200, 200, 210];
/// m.
const LINK_RADIUS: f32 = 0.015;

/// Where the columns of a chunk go.
pub struct ChunkColumns {
    series: Vec<PlottedSeries>,
    bodies: Vec<EntityPath>,
    wheels: Vec<WheelShape>,
    links: Vec<Link>,
    /// Index of the body the camera follows.
    followed: usize,
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
        let bodies = layout.train.bodies.iter();
        Ok(Self {
            series,
            bodies: bodies.map(|b| body_entity(&b.name)).collect(),
            wheels,
            links,
            followed: layout.train.load.unwrap_or(layout.train.bodies.len() / 2),
        })
    }

    /// All lines, for the layout of the viewer.
    pub fn series(&self) -> &[PlottedSeries] {
        &self.series
    }

    /// Some seconds of the run.
    pub fn log(&self, stream: &mut MessageStream, chunk: &Chunk) -> Result<(), Error> {
        let all_times = times(chunk.time_ns.clone());
        for s in &self.series {
            scalars(stream, s, chunk, &all_times)?;
        }
        let pose_times = times(chunk.pose_time_ns.clone());
        self.poses(stream, chunk, &pose_times)?;
        self.wheels(stream, chunk, &pose_times)?;
        self.links(stream, chunk, &pose_times)?;
        self.follow(stream, chunk, &pose_times)?;
        if !chunk.events.is_empty() {
            let (ns, texts): (Vec<i64>, Vec<&str>) =
                chunk.events.iter().map(|(t, s)| (*t, s.as_str())).unzip();
            let log = TextLog::update_fields()
                .with_many_level(vec!["INFO"; texts.len()])
                .with_many_text(texts);
            let columns = log.columns_of_unit_batches();
            send(stream, entity(["events"]), times(ns), columns)?;
        }
        Ok(())
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
                .with_many_translation(poses.iter().map(|(p, _)| p.map(|x| x as f32)))
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
            .with_many_translation(poses.iter().map(|(p, _)| p.map(|x| x as f32)))
            .with_many_quaternion(poses.iter().map(upright))
            .columns_of_unit_batches();
        send(stream, follow_entity(), pose_times.clone(), columns)
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
                point(&(isometry(pose) * nalgebra::Point3::from(link.anchors[k])).coords)
            };
            let strips = a.iter().zip(b).map(|(a, b)| vec![end(a, 0), end(b, 1)]);
            let columns = LineStrips3D::new(strips).columns_of_unit_batches();
            send(stream, link.entity.clone(), pose_times.clone(), columns)?;
        }
        Ok(())
    }
}

/// Rows without a finite value are left out: plots have nothing to draw there.
fn scalars(
    stream: &mut MessageStream,
    series: &PlottedSeries,
    chunk: &Chunk,
    all_times: &TimeColumn,
) -> Result<(), Error> {
    let column = |i: usize| chunk.values.get(i).map_or(&[][..], Vec::as_slice);
    // 1 where row `i` is valid, else not a number
    let mask = |valid: Option<usize>, i: usize| match valid.and_then(|v| column(v).get(i)) {
        Some(&v) if v != 1.0 => f64::NAN,
        _ => 1.0,
    };
    let (values, width): (Vec<f64>, usize) = match series.line {
        ScalarSource::Value {
            channel,
            scale,
            valid,
        } => {
            let x = column(channel).iter().enumerate();
            (x.map(|(i, x)| x * scale * mask(valid, i)).collect(), 1)
        }
        ScalarSource::Band {
            channel,
            sd,
            scale,
            valid,
        } => {
            let pairs = column(channel).iter().zip(column(sd)).enumerate();
            let ends = |(i, (x, sd)): (usize, (&f64, &f64))| {
                let scale = scale * mask(valid, i);
                [(x - 2.0 * sd) * scale, (x + 2.0 * sd) * scale]
            };
            (pairs.flat_map(ends).collect(), 2)
        }
    };
    let (values, row_times) = if values.iter().all(|x| x.is_finite()) {
        (values, all_times.clone())
    } else {
        let rows = values.chunks_exact(width).zip(&chunk.time_ns);
        let good: Vec<_> = rows
            .filter(|(v, _)| v.iter().all(|x| x.is_finite()))
            .collect();
        let ns = good.iter().map(|(_, t)| **t).collect();
        let values = good.iter().flat_map(|(v, _)| v.iter().copied()).collect();
        (values, times(ns))
    };
    if values.is_empty() {
        return Ok(());
    }
    let rows = values.len() / width;
    let columns = Scalars::new(values).columns(std::iter::repeat_n(width, rows));
    send(stream, series.entity.clone(), row_times, columns)
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

fn send<I: IntoIterator<Item = SerializedComponentColumn>>(
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

fn xyzw(q: [f64; 4]) -> RerunQuaternion {
    RerunQuaternion::from_xyzw(q.map(|x| x as f32))
}

/// Position and quaternion xyzw as a transformation.
pub fn isometry((p, q): &([f64; 3], [f64; 4])) -> Isometry3<f64> {
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(q[3], q[0], q[1], q[2]));
    Isometry3::from_parts(Translation3::from(*p), rotation)
}
