//! What stands still in the world, and what the bodies of the train look like.

use crate::stream::{MessageStream, entity};
use monorig_sim::error::Error;
use monorig_sim::rail::RailFrame;
use monorig_sim::record::Layout;
use monorig_sim::train::{Geometry, Shape, Train};
use nalgebra::{Isometry3, Vector3};
use re_sdk_types::archetypes::{
    Boxes3D, Cylinders3D, Ellipsoids3D, LineStrips3D, Mesh3D, TextDocument, Transform3D,
    ViewCoordinates,
};
use re_sdk_types::components::{Color, FillMode, Radius};
use re_sdk_types::datatypes::Quaternion;
use rerun::{AsComponents, EntityPath};

/// Frames of rail in one mesh: long rails stay quick to draw, since what is out of sight is left out.
const FRAMES_PER_MESH: usize = 200;
const RAIL: [u8; 4] = [150, 155, 165, 255];
const RAIL_LINE: [u8; 4] = [110, 120, 140, 255];
const OBSTACLE: [u8; 4] = [150, 110, 80, 255];
const SPOKE: [u8; 4] = [245, 200, 60, 255];

/// A shape that turns with a friction wheel.
pub struct WheelShape {
    /// The entity that turns, about its own z axis.
    pub entity: EntityPath,
    /// Index of the drive, 0 left / 1 right.
    pub spins: (usize, usize),
}

/// The entity of a body; it carries the pose. (The name of a suspended part, `unit/link`, is one part here: it does not
/// move with its unit.)
pub fn body_entity(name: &str) -> EntityPath {
    entity(["world", "train", &name.replace('/', ".")])
}

/// Everything that is drawn and does not change. Returns the wheels, which turn.
pub fn log(stream: &mut MessageStream, layout: &Layout<'_>) -> Result<Vec<WheelShape>, Error> {
    let about = format!(
        "# {} · seed {}\n\n{}\n\nVehicle: {}\n",
        layout.scenario, layout.seed, layout.why, layout.train.name
    );
    stream.fixed(
        entity(["about"]),
        &TextDocument::new(about).with_media_type("text/markdown"),
    )?;
    stream.fixed(entity(["world"]), &ViewCoordinates::RIGHT_HAND_Z_UP())?;
    rail(stream, layout.rail, layout.profile)?;
    obstacles(stream, layout.obstacles)?;
    train(stream, layout.train)
}

fn rail(
    stream: &mut MessageStream,
    frames: &[RailFrame],
    profile: &[[f64; 2]],
) -> Result<(), Error> {
    if frames.len() < 2 {
        return Ok(());
    }
    let line = frames.iter().map(|f| point(&f.p));
    stream.fixed(
        entity(["world", "track", "line"]),
        &LineStrips3D::new([line.collect::<Vec<_>>()])
            .with_colors([colour(RAIL_LINE)])
            .with_radii([Radius::new_ui_points(1.0)]),
    )?;
    if profile.len() < 3 {
        return Ok(());
    }
    // Neighbouring meshes share a frame, so that there is no gap.
    for (i, first) in (0..frames.len() - 1).step_by(FRAMES_PER_MESH).enumerate() {
        let last = (first + FRAMES_PER_MESH).min(frames.len() - 1);
        let sweep = sweep(&frames[first..=last], profile);
        let mesh = Mesh3D::new(sweep.positions)
            .with_vertex_normals(sweep.normals)
            .with_triangle_indices(sweep.triangles)
            .with_albedo_factor(*colour(RAIL));
        stream.fixed(
            entity(["world", "track", "rail", &format!("{i:04}")]),
            &mesh,
        )?;
    }
    Ok(())
}

/// A surface of triangles.
struct Sweep {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

/// A closed outline (l, u), counter-clockwise, moved along the frames. Each side of the outline has vertices of its
/// own, so that edges stay sharp; normals and the order of the corners point outwards.
fn sweep(frames: &[RailFrame], outline: &[[f64; 2]]) -> Sweep {
    let mut out = Sweep {
        positions: Vec::new(),
        normals: Vec::new(),
        triangles: Vec::new(),
    };
    let sides = outline.len() as u32;
    for (row, f) in frames.iter().enumerate() {
        for i in 0..outline.len() {
            let (a, b) = (outline[i], outline[(i + 1) % outline.len()]);
            let normal = f.l * (b[1] - a[1]) - f.u * (b[0] - a[0]);
            let normal = normal.try_normalize(1e-12).unwrap_or(f.u);
            for [l, u] in [a, b] {
                out.positions.push(point(&(f.p + f.l * l + f.u * u)));
                out.normals.push(point(&normal));
            }
        }
        if row + 1 < frames.len() {
            for side in 0..sides {
                let a = 2 * (row as u32 * sides + side);
                let (b, a_next, b_next) = (a + 1, a + 2 * sides, a + 2 * sides + 1);
                out.triangles.push([a, b, a_next]);
                out.triangles.push([b, b_next, a_next]);
            }
        }
    }
    out
}

fn obstacles(
    stream: &mut MessageStream,
    obstacles: &[(Isometry3<f64>, Vector3<f64>)],
) -> Result<(), Error> {
    if obstacles.is_empty() {
        return Ok(());
    }
    let boxes = Boxes3D::from_centers_and_sizes(
        obstacles
            .iter()
            .map(|(pose, _)| point(&pose.translation.vector)),
        obstacles.iter().map(|(_, size)| point(size)),
    )
    .with_quaternions(obstacles.iter().map(|(pose, _)| quaternion(pose)))
    .with_fill_mode(FillMode::Solid)
    .with_colors([colour(OBSTACLE)]);
    stream.fixed(entity(["world", "obstacles"]), &boxes)
}

fn train(stream: &mut MessageStream, train: &Train) -> Result<Vec<WheelShape>, Error> {
    let mut wheels = Vec::new();
    for body in &train.bodies {
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
            stream.fixed(at.clone(), &transform(&shape.pose))?;
            let Some(spins) = shape.spins else {
                stream.fixed(at, &*solid(shape))?;
                continue;
            };
            let turning = at.join(&entity(["spin"]));
            stream.fixed(turning.clone(), &*solid(shape))?;
            if let Geometry::Cylinder(radius, length) = shape.geometry {
                let at = turning.join(&entity(["spokes"]));
                stream.fixed(at, &spokes(radius, length))?;
            }
            wheels.push(WheelShape {
                entity: turning,
                spins,
            });
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
            Boxes3D::from_sizes([point(size)])
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
            positions.push(point(&corner));
            normals.push(point(&normal));
        }
    }
    Mesh3D::new(positions).with_vertex_normals(normals)
}

fn transform(pose: &Isometry3<f64>) -> Transform3D {
    Transform3D::from_translation_rotation(point(&pose.translation.vector), quaternion(pose))
}

/// Single precision is what the viewer draws with.
pub fn point(v: &Vector3<f64>) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
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

    fn straight(n: usize, step: f64) -> Vec<RailFrame> {
        (0..n)
            .map(|i| RailFrame {
                s: i as f64 * step,
                p: Vector3::new(i as f64 * step, 0.0, 0.0),
                t: Vector3::x(),
                l: Vector3::y(),
                u: Vector3::z(),
                k: Vector3::zeros(),
            })
            .collect()
    }

    fn vec(p: [f32; 3]) -> Vector3<f64> {
        Vector3::new(p[0] as f64, p[1] as f64, p[2] as f64)
    }

    /// Area = perimeter × length; volume by the divergence theorem = area of the outline × length less the open ends,
    /// which lie in planes through x = 0 and x = L: ∮ x n_x vanishes on the sides, so y n_y and z n_z give it each.
    #[test]
    fn sweep_has_the_area_and_encloses_the_volume_of_the_beam() {
        let outline = [
            [-0.5, -0.2],
            [0.5, -0.2],
            [0.1, 0.0],
            [0.5, 0.2],
            [-0.5, 0.2],
            [-0.1, 0.0],
        ];
        let out = sweep(&straight(5, 0.75), &outline);
        let (mut area, mut volume) = (0.0, 0.0);
        for t in &out.triangles {
            let [a, b, c] = t.map(|i| vec(out.positions[i as usize]));
            let n = (b - a).cross(&(c - a)) / 2.0;
            area += n.norm();
            volume += n.y * (a.y + b.y + c.y) / 3.0;
            for i in t {
                let normal = vec(out.normals[*i as usize]);
                assert!(
                    (normal.dot(&n.normalize()) - 1.0).abs() < 1e-6,
                    "normal points elsewhere"
                );
            }
        }
        let side = |i: usize| {
            let (a, b): ([f64; 2], [f64; 2]) = (outline[i], outline[(i + 1) % 6]);
            (a, b)
        };
        let perimeter: f64 = (0..6)
            .map(side)
            .map(|(a, b)| (b[0] - a[0]).hypot(b[1] - a[1]))
            .sum();
        let section: f64 = (0..6)
            .map(side)
            .map(|(a, b)| (a[0] * b[1] - b[0] * a[1]) / 2.0)
            .sum();
        assert!((area - 3.0 * perimeter).abs() < 1e-5);
        assert!((volume - 3.0 * section).abs() < 1e-5);
    }

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
