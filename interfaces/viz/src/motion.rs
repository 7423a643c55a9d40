//! The moving parts: bodies, wheels, drawbars and chains, and the frame that the camera follows.

use crate::lines::ROWS_A_MESSAGE;
use crate::origin::{Origin, plan_point};
use crate::scene::{WheelShape, body_entity};
use crate::stream::{MessageStream, entity, send, times};
use monorig_sim::error::Error;
use monorig_sim::record::{Chunk, Layout};
use monorig_sim::train::ConnectionKind;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use re_sdk_types::archetypes::{LineStrips3D, Points2D, Transform3D};
use re_sdk_types::components::Color;
use rerun::{EntityPath, SerializationError, SerializedComponentColumn};

const LINK: [u8; 3] = [200, 200, 210];
/// m.
const LINK_RADIUS: f32 = 0.015;

/// All that moves, and what is not yet sent of it.
pub struct MovingBodies {
    origin: Origin,
    bodies: Vec<EntityPath>,
    wheels: Vec<WheelShape>,
    links: Vec<Link>,
    /// Index of the body the camera follows.
    followed: usize,
    /// Poses and wheel angles that are not yet sent.
    pending: Chunk,
}

/// Columns of an entity, or the error of the library.
type BodyColumns = Result<Vec<SerializedComponentColumn>, SerializationError>;
/// Sends columns of an entity at the times of the poses.
type SendColumns<'a> = dyn FnMut(EntityPath, BodyColumns) -> Result<(), Error> + 'a;

/// A line between two bodies.
struct Link {
    entity: EntityPath,
    bodies: [usize; 2],
    anchors: [Vector3<f64>; 2],
}

/// A frame that moves with the train: origin at the followed body, x along its heading, z up. For the camera.
pub fn follow_entity() -> EntityPath {
    entity(["world", "follow"])
}

impl MovingBodies {
    /// Styles are logged here; `wheels` as they came from the scene.
    pub fn begin(
        stream: &mut MessageStream,
        layout: &Layout<'_>,
        wheels: Vec<WheelShape>,
        origin: Origin,
    ) -> Result<Self, Error> {
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
            origin,
            bodies: bodies.map(|b| body_entity(&b.name)).collect(),
            wheels,
            links,
            followed: layout.train.load.unwrap_or(layout.train.bodies.len() / 2),
            pending: Chunk::default(),
        })
    }

    fn place(&self, place: &[f64; 3]) -> [f32; 3] {
        self.origin.point(&Vector3::from(*place))
    }

    /// Poses of the body the camera follows, in this chunk.
    pub fn followed<'a>(&self, chunk: &'a Chunk) -> Option<&'a [([f64; 3], [f64; 4])]> {
        let poses = chunk.poses.get(self.followed)?;
        (!poses.is_empty()).then_some(poses)
    }

    /// Some seconds of the run.
    pub fn log(&mut self, stream: &mut MessageStream, chunk: &Chunk) -> Result<(), Error> {
        let all = &mut self.pending;
        all.pose_time_ns.extend_from_slice(&chunk.pose_time_ns);
        extend_each(&mut all.poses, &chunk.poses);
        extend_each(&mut all.wheel_angles, &chunk.wheel_angles);
        match all.pose_time_ns.len() >= ROWS_A_MESSAGE {
            true => self.flush(stream),
            false => Ok(()),
        }
    }

    /// Send what is left.
    pub fn flush(&mut self, stream: &mut MessageStream) -> Result<(), Error> {
        let mut chunk = std::mem::take(&mut self.pending);
        let pose_times = times(std::mem::take(&mut chunk.pose_time_ns));
        let mut send = |entity: EntityPath, columns: BodyColumns| {
            send(stream, entity, pose_times.clone(), columns)
        };
        self.poses(&chunk, &mut send)?;
        self.wheels(&chunk, &mut send)?;
        self.links(&chunk, &mut send)?;
        self.follow(&chunk, &mut send)
    }

    fn poses(&self, chunk: &Chunk, send: &mut SendColumns<'_>) -> Result<(), Error> {
        for (body, poses) in self.bodies.iter().zip(&chunk.poses) {
            if poses.is_empty() {
                continue;
            }
            let places = poses.iter().map(|(p, _)| self.place(p));
            let columns = Transform3D::update_fields()
                .with_many_translation(places)
                .with_many_quaternion(poses.iter().map(|(_, q)| xyzw(*q)))
                .columns_of_unit_batches()
                .map(Iterator::collect);
            send(body.clone(), columns)?;
        }
        Ok(())
    }

    fn follow(&self, chunk: &Chunk, send: &mut SendColumns<'_>) -> Result<(), Error> {
        let Some(poses) = self.followed(chunk) else {
            return Ok(());
        };
        let upright = |pose: &([f64; 3], [f64; 4])| {
            let ahead = isometry(pose).rotation * Vector3::x();
            let half = ahead.y.atan2(ahead.x) / 2.0;
            xyzw([0.0, 0.0, half.sin(), half.cos()])
        };
        let places = poses.iter().map(|(p, _)| self.place(p));
        let columns = Transform3D::update_fields()
            .with_many_translation(places)
            .with_many_quaternion(poses.iter().map(upright))
            .columns_of_unit_batches()
            .map(Iterator::collect);
        send(follow_entity(), columns)?;
        let on_plan = poses.iter().map(|(p, _)| plan_point(&self.origin, p));
        let columns = Points2D::update_fields()
            .with_positions(on_plan)
            .columns_of_unit_batches()
            .map(Iterator::collect);
        send(entity(["plan", "train"]), columns)
    }

    fn wheels(&self, chunk: &Chunk, send: &mut SendColumns<'_>) -> Result<(), Error> {
        for wheel in &self.wheels {
            let (drive, side) = wheel.spins;
            let Some(angles) = chunk.wheel_angles.get(drive).filter(|a| !a.is_empty()) else {
                continue;
            };
            let about_z = |angle: f64| [0.0, 0.0, (angle / 2.0).sin(), (angle / 2.0).cos()];
            let angle = |pair: &[f64; 2]| pair[side.min(1)];
            let columns = Transform3D::update_fields()
                .with_many_quaternion(angles.iter().map(|a| xyzw(about_z(angle(a)))))
                .columns_of_unit_batches()
                .map(Iterator::collect);
            send(wheel.entity.clone(), columns)?;
        }
        Ok(())
    }

    fn links(&self, chunk: &Chunk, send: &mut SendColumns<'_>) -> Result<(), Error> {
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
            let columns = LineStrips3D::new(strips)
                .columns_of_unit_batches()
                .map(Iterator::collect);
            send(link.entity.clone(), columns)?;
        }
        Ok(())
    }
}

/// Appends each column of `more` to its own of `all`.
fn extend_each<T: Clone>(all: &mut Vec<Vec<T>>, more: &[Vec<T>]) {
    all.resize(all.len().max(more.len()), Vec::new());
    for (all, more) in all.iter_mut().zip(more) {
        all.extend_from_slice(more);
    }
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

fn xyzw(q: [f64; 4]) -> re_sdk_types::datatypes::Quaternion {
    re_sdk_types::datatypes::Quaternion::from_xyzw(q.map(|x| x as f32))
}

/// Position and quaternion xyzw as a transformation.
pub fn isometry((p, q): &([f64; 3], [f64; 4])) -> Isometry3<f64> {
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(q[3], q[0], q[1], q[2]));
    Isometry3::from_parts(Translation3::from(*p), rotation)
}
