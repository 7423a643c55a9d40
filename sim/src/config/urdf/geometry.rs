//! Visual and collision elements of a URDF link as shapes.
//!
//! A `<collision>` equal to a `<visual>` of the same link makes that visual touchable; any other becomes a shape of its
//! own that is fully transparent (alpha 0): there to be touched, not to be drawn.

use super::file::File;
use super::stl;
use crate::error::Error;
use crate::train::{Geometry, Shape};
use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};
use urdf_rs::{Link, Robot, Visual};

const GREY: [f32; 4] = [0.6, 0.6, 0.6, 1.0];
const INVISIBLE: [f32; 4] = [0.0; 4];

/// Shapes of a link whose frame has `link_pose` in its body's frame.
pub(super) fn shapes(
    file: &File<'_>,
    robot: &Robot,
    link: &Link,
    link_pose: &Isometry3<f64>,
) -> Result<Vec<Shape>, Error> {
    let mut shapes = Vec::new();
    let mut add = |origin, geometry, rgba, collides| -> Result<(), Error> {
        shapes.push(Shape {
            link: link.name.clone(),
            pose: link_pose * file.pose("link", &link.name, origin)?,
            geometry: convert(file, link, geometry)?,
            rgba,
            collides,
            spins: None,
        });
        Ok(())
    };
    let twin = |v: &Visual, c: &urdf_rs::Collision| {
        same_place(&v.origin, &c.origin) && same(&v.geometry, &c.geometry)
    };
    for v in &link.visual {
        add(
            &v.origin,
            &v.geometry,
            colour(robot, v),
            link.collision.iter().any(|c| twin(v, c)),
        )?;
    }
    for c in link
        .collision
        .iter()
        .filter(|c| !link.visual.iter().any(|v| twin(v, c)))
    {
        add(&c.origin, &c.geometry, INVISIBLE, true)?;
    }
    Ok(shapes)
}

/// A wheel turns about the z axis of each of its shapes, so each must sit on the axle.
pub(super) fn check_wheel(
    file: &File<'_>,
    link: &Link,
    shapes: &[Shape],
    centre: &Vector3<f64>,
    axle: &Vector3<f64>,
) -> Result<(), Error> {
    let off = |s: &&Shape| {
        let z = s.pose.rotation * Vector3::z();
        z.cross(axle).norm() > 1e-6
            || (s.pose.translation.vector - centre).cross(axle).norm() > 1e-6
    };
    let help = "centre each shape of a friction wheel on the axle, with z along the axle; move parts that do not turn to another link";
    match shapes.iter().find(off) {
        Some(_) => Err(file.fault(
            "link",
            &link.name,
            "a shape of this friction wheel is not centred on its axle",
            help,
        )),
        None => Ok(()),
    }
}

fn same_place(a: &urdf_rs::Pose, b: &urdf_rs::Pose) -> bool {
    a.xyz == b.xyz && a.rpy == b.rpy
}

fn same(a: &urdf_rs::Geometry, b: &urdf_rs::Geometry) -> bool {
    use urdf_rs::Geometry::{Box, Cylinder, Mesh, Sphere};
    match (a, b) {
        (Box { size: a }, Box { size: b }) => a == b,
        (
            Cylinder {
                radius: a,
                length: m,
            },
            Cylinder {
                radius: b,
                length: n,
            },
        ) => a == b && m == n,
        (Sphere { radius: a }, Sphere { radius: b }) => a == b,
        (
            Mesh {
                filename: a,
                scale: m,
            },
            Mesh {
                filename: b,
                scale: n,
            },
        ) => a == b && m == n,
        _ => false,
    }
}

fn colour(robot: &Robot, visual: &Visual) -> [f32; 4] {
    let Some(material) = &visual.material else {
        return GREY;
    };
    let named = || {
        robot
            .materials
            .iter()
            .find(|m| m.name == material.name)?
            .color
            .as_ref()
    };
    let clean = |x: f64| {
        if x.is_finite() {
            x.clamp(0.0, 1.0) as f32
        } else {
            0.5
        }
    };
    material
        .color
        .as_ref()
        .or_else(named)
        .map_or(GREY, |c| c.rgba.map(clean))
}

fn convert(file: &File<'_>, link: &Link, geometry: &urdf_rs::Geometry) -> Result<Geometry, Error> {
    let fault = |message: String, help: &str| file.fault("link", &link.name, message, help);
    let sized = |numbers: &[f64], shape: Geometry| {
        if numbers
            .iter()
            .all(|x| x.is_finite() && *x > 0.0 && *x < 1e6)
        {
            Ok(shape)
        } else {
            Err(fault(
                format!("a shape measures {numbers:?} m"),
                "sizes above zero, in metres",
            ))
        }
    };
    match geometry {
        urdf_rs::Geometry::Box { size } => sized(&size.0, Geometry::Box(size.0.into())),
        urdf_rs::Geometry::Cylinder { radius, length } => {
            sized(&[*radius, *length], Geometry::Cylinder(*radius, *length))
        }
        urdf_rs::Geometry::Sphere { radius } => sized(&[*radius], Geometry::Sphere(*radius)),
        urdf_rs::Geometry::Capsule { .. } => Err(fault(
            "monorig does not support capsules".into(),
            "box, cylinder, sphere or mesh",
        )),
        urdf_rs::Geometry::Mesh { filename, scale } => {
            mesh(file, link, filename, scale.map_or([1.0; 3], |s| s.0))
        }
    }
}

fn mesh(file: &File<'_>, link: &Link, filename: &str, scale: [f64; 3]) -> Result<Geometry, Error> {
    let fault = |message: String, help: &str| file.fault("link", &link.name, message, help);
    if scale.iter().any(|x| !x.is_finite() || *x == 0.0) {
        return Err(fault(
            format!("mesh scale is {scale:?}"),
            "use three finite numbers other than zero",
        ));
    }
    if !filename.to_ascii_lowercase().ends_with(".stl") {
        return Err(fault(
            format!("mesh `{filename}` is not an .stl file"),
            "export it as STL, in metres",
        ));
    }
    let path = file.path.with_file_name("").join(filename);
    if crate::config::file::exists(&path).is_err() {
        return Err(fault(
            format!("mesh file `{}` is missing", path.display()),
            "a path relative to the URDF file",
        ));
    }
    let (mut vertices, mut triangles) = stl::read(&path)?;
    for v in &mut vertices {
        *v = [v[0] * scale[0], v[1] * scale[1], v[2] * scale[2]];
    }
    if scale.iter().product::<f64>() < 0.0 {
        triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    Ok(Geometry::Mesh {
        vertices,
        triangles,
    })
}

/// Half a turn about z: how a unit that faces backwards is built in.
pub(crate) fn half_turn() -> Isometry3<f64> {
    let turn = UnitQuaternion::new_unchecked(Quaternion::new(0.0, 0.0, 0.0, 1.0));
    Isometry3::from_parts(nalgebra::Translation3::identity(), turn)
}
