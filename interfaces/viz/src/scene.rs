//! The parts of the world that stand still, and the shapes of the train.

use crate::origin::{Origin, single};
use crate::stream::{MessageStream, entity};
use crate::track;
use monorig_sim::error::Error;
use monorig_sim::record::Layout;
use monorig_sim::train::{Geometry, Shape, Train};
use nalgebra::{Isometry3, Vector3};
use re_sdk_types::archetypes::{
    Boxes3D, Cylinders3D, Ellipsoids3D, Mesh3D, TextDocument, Transform3D, ViewCoordinates,
};
use re_sdk_types::components::Color;
use re_sdk_types::components::FillMode;
use re_sdk_types::datatypes::Quaternion;
use rerun::{AsComponents, EntityPath};

const OBSTACLE: [u8; 4] = [150, 110, 80, 255];
const SPOKE: [u8; 4] = [245, 200, 60, 255];
/// Axes that differ by less are one, m and 1.
const SAME_AXIS: f64 = 1e-6;

/// A friction wheel: what turns about one axis by one angle.
pub struct WheelShape {
    /// The entity that turns, about its own z axis.
    pub entity: EntityPath,
    /// Pose in its body when it is not turned.
    pose: Isometry3<f64>,
    /// Index of the drive, 0 left / 1 right.
    pub spins: (usize, usize),
}

impl WheelShape {
    /// Returns whether a shape of the same body at `pose` turns by the same angle about the same axis.
    fn turns_with(&self, spins: (usize, usize), pose: &Isometry3<f64>) -> bool {
        let relative = self.pose.inv_mul(pose);
        let axis = relative.rotation * Vector3::z();
        let place = relative.translation.vector;
        self.spins == spins && axis.z > 1.0 - SAME_AXIS && place.xy().norm() < SAME_AXIS
    }
}

/// The entity of a body; it carries the pose. (The name of a suspended part, `unit/link`, is one part here: it does not
/// move with its unit.)
pub fn body_entity(name: &str) -> EntityPath {
    entity(["world", "train", &name.replace('/', ".")])
}

/// Everything that is drawn and does not change. Returns the wheels, which turn.
pub fn log(
    stream: &mut MessageStream,
    layout: &Layout<'_>,
    origin: &Origin,
) -> Result<Vec<WheelShape>, Error> {
    let at = origin.world();
    let about = format!(
        "# {} · seed {}\n\n{}\n\nVehicle: {}\n\nCoordinates are relative to the start of the rail, which is at ({:.3}, {:.3}, {:.3}) m.\n\n\
         Rail: orange climbs, blue descends, grey is level. Violet: places where a part of the scenario acts on the rail.\n",
        layout.scenario, layout.seed, layout.why, layout.train.name, at.x, at.y, at.z
    );
    stream.fixed(
        entity(["about"]),
        &TextDocument::new(about).with_media_type("text/markdown"),
    )?;
    stream.fixed(entity(["world"]), &ViewCoordinates::RIGHT_HAND_Z_UP())?;
    track::log(stream, layout, origin)?;
    obstacles(stream, layout.obstacles, origin)?;
    train(stream, layout.train)
}

fn obstacles(
    stream: &mut MessageStream,
    obstacles: &[(Isometry3<f64>, Vector3<f64>)],
    origin: &Origin,
) -> Result<(), Error> {
    if obstacles.is_empty() {
        return Ok(());
    }
    let boxes = Boxes3D::from_centers_and_sizes(
        obstacles
            .iter()
            .map(|(pose, _)| origin.point(&pose.translation.vector)),
        obstacles.iter().map(|(_, size)| single(size)),
    )
    .with_quaternions(obstacles.iter().map(|(pose, _)| quaternion(pose)))
    .with_fill_mode(FillMode::Solid)
    .with_colors([colour(OBSTACLE)]);
    stream.fixed(entity(["world", "obstacles"]), &boxes)
}

fn train(stream: &mut MessageStream, train: &Train) -> Result<Vec<WheelShape>, Error> {
    let mut wheels: Vec<WheelShape> = Vec::new();
    for body in &train.bodies {
        let first_wheel = wheels.len();
        let place = body_entity(&body.name);
        for (i, shape) in body.shapes.iter().enumerate() {
            let earlier = body.shapes[..i]
                .iter()
                .filter(|s| s.link == shape.link)
                .count();
            let name = match earlier {
                0 => shape.link.replace('/', "."),
                n => format!("{}_{}", shape.link.replace('/', "."), n + 1),
            };
            let at = place.join(&entity([name.as_str()]));
            let Some(spins) = shape.spins else {
                stream.all_fixed(at, &[&transform(&shape.pose), &*solid(shape)])?;
                continue;
            };
            let of_body = &wheels[first_wheel..];
            let with = of_body.iter().find(|w| w.turns_with(spins, &shape.pose));
            let turning = match with {
                // parts of one wheel turn together: one pose an instant is enough for them
                Some(wheel) => {
                    let at = wheel.entity.join(&entity([name.as_str()]));
                    let pose = transform(&wheel.pose.inv_mul(&shape.pose));
                    stream.all_fixed(at.clone(), &[&pose, &*solid(shape)])?;
                    at
                }
                None => {
                    stream.fixed(at.clone(), &transform(&shape.pose))?;
                    let at = at.join(&entity(["spin"]));
                    stream.fixed(at.clone(), &*solid(shape))?;
                    wheels.push(WheelShape {
                        entity: at.clone(),
                        pose: shape.pose,
                        spins,
                    });
                    at
                }
            };
            if let Geometry::Cylinder(radius, length) = shape.geometry {
                let at = turning.join(&entity(["spokes"]));
                stream.fixed(at, &spokes(radius, length))?;
            }
        }
    }
    Ok(wheels)
}

/// A cross that stands out of both faces of a wheel: without it, its rotation does not show.
fn spokes(radius: f64, length: f64) -> Boxes3D {
    let (long, wide, high) = (1.7 * radius, 0.16 * radius, length + 0.012);
    Boxes3D::from_sizes([
        [long as f32, wide as f32, high as f32],
        [wide as f32, long as f32, high as f32],
    ])
    .with_fill_mode(FillMode::Solid)
    .with_colors([colour(SPOKE)])
}

fn solid(shape: &Shape) -> Box<dyn AsComponents> {
    let colour = linear_colour(shape.rgba);
    match &shape.geometry {
        Geometry::Box(size) => Box::new(
            Boxes3D::from_sizes([single(size)])
                .with_fill_mode(FillMode::Solid)
                .with_colors([colour]),
        ),
        Geometry::Cylinder(radius, length) => Box::new(
            Cylinders3D::from_lengths_and_radii([*length as f32], [*radius as f32])
                .with_fill_mode(FillMode::Solid)
                .with_colors([colour]),
        ),
        Geometry::Sphere(radius) => Box::new(
            Ellipsoids3D::from_radii([*radius as f32])
                .with_fill_mode(FillMode::Solid)
                .with_colors([colour]),
        ),
        Geometry::Mesh {
            vertices,
            triangles,
        } => Box::new(flat(vertices, triangles).with_albedo_factor(*colour)),
    }
}

/// A mesh with a normal for each triangle, as machine parts look. Triangles that name no vertex are left out.
fn flat(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> Mesh3D {
    let mut positions = Vec::new();
    let mut normals = Vec::new();
    for t in triangles {
        let corner = |i: usize| vertices.get(t[i] as usize).map(|v| Vector3::from(*v));
        let (Some(a), Some(b), Some(c)) = (corner(0), corner(1), corner(2)) else {
            continue;
        };
        let normal = (b - a).cross(&(c - a));
        let normal = normal.try_normalize(1e-18).unwrap_or(Vector3::z());
        for corner in [a, b, c] {
            positions.push(single(&corner));
            normals.push(single(&normal));
        }
    }
    Mesh3D::new(positions).with_vertex_normals(normals)
}

fn transform(pose: &Isometry3<f64>) -> Transform3D {
    Transform3D::from_translation_rotation(single(&pose.translation.vector), quaternion(pose))
}

fn quaternion(pose: &Isometry3<f64>) -> Quaternion {
    let q = pose.rotation.coords;
    Quaternion::from_xyzw([q.x as f32, q.y as f32, q.z as f32, q.w as f32])
}

fn colour([r, g, b, a]: [u8; 4]) -> Color {
    Color::from_unmultiplied_rgba(r, g, b, a)
}

/// Linear light to sRGB (IEC 61966-2-1).
fn linear_colour([r, g, b, a]: [f32; 4]) -> Color {
    let byte = |x: f32| (x.clamp(0.0, 1.0) * 255.0).round() as u8;
    let srgb = |x: f32| match x {
        x if x <= 0.003_130_8 => byte(12.92 * x),
        x => byte(1.055 * x.powf(1.0 / 2.4) - 0.055),
    };
    Color::from_unmultiplied_rgba(srgb(r), srgb(g), srgb(b), byte(a))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mesh_with_a_wrong_index_is_drawn_without_that_triangle() {
        let vertices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let mesh = flat(&vertices, &[[0, 1, 2], [0, 1, 9]]);
        assert_eq!(mesh.num_vertices(), 3);
    }

    #[test]
    fn half_light_is_byte_188() {
        assert_eq!(
            linear_colour([0.5, 0.0, 1.0, 1.0]),
            Color::from_rgb(188, 0, 255)
        );
    }
}
