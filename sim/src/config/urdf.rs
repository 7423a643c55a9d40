//! A unit's URDF as rigid bodies: links joined by fixed, continuous, revolute and prismatic joints (at rest) are one
//! body; a `floating` joint starts a body of its own.
//!
//! A `continuous` joint marks a friction wheel: its spin is a state of the simulation, its mass rides on the body.
//! Wheels that merely roll along (running wheels, guide wheels) are `fixed`.

mod diagnostics;
mod file;
mod geometry;
mod limits;
mod stl;
mod tree;

pub(crate) use geometry::half_turn;

use crate::config::file::read_text;
use crate::error::Error;
use crate::train::inertia::MassProperties;
use crate::train::{Geometry, Shape};
use file::File;
use nalgebra::{Isometry3, Matrix3, Vector3};
use std::path::Path;
use tree::{Branch, tree};
use urdf_rs::{Joint, JointType, Link, Robot};

/// A URDF file as read.
#[derive(Clone, Debug)]
pub struct UrdfUnit {
    /// Rigid bodies; the first holds the root link.
    pub bodies: Vec<UrdfBody>,
    /// Every link, parents before children.
    pub places: Vec<LinkPlace>,
    /// Links on continuous joints.
    pub friction_wheels: Vec<FrictionWheel>,
}

/// Links lumped into one rigid body. Its frame is the frame of its first link.
#[derive(Clone, Debug)]
pub struct UrdfBody {
    /// Name of the first link.
    pub root: String,
    /// Pose of the body frame in the frame of the unit's root link.
    pub pose: Isometry3<f64>,
    /// Mass properties in the body frame.
    pub mass: MassProperties,
    /// Shapes of the link: visible and for collisions.
    pub shapes: Vec<Shape>,
}

/// A link as a place on a body.
#[derive(Clone, Debug)]
pub struct LinkPlace {
    /// Link name.
    pub link: String,
    /// Index of the body.
    pub body: usize,
    /// Pose of the link frame in the body frame.
    pub pose: Isometry3<f64>,
    /// The link's own mass properties in the body frame; none for a pure frame.
    pub mass: Option<MassProperties>,
    /// Radius of the link's first cylinder, m: the wheel radius if it is a wheel.
    pub radius_m: Option<f64>,
}

/// A friction wheel.
#[derive(Clone, Copy, Debug)]
pub struct FrictionWheel {
    /// Index in [`UrdfUnit::places`].
    pub place: usize,
    /// Axle in the body frame, unit length.
    pub axle: Vector3<f64>,
    /// Moment of inertia about the axle, kg·m².
    pub inertia: f64,
    /// Highest rate of the joint, rad/s.
    pub rate_max_radps: f64,
    /// Highest torque of the joint, N·m.
    pub torque_max_nm: f64,
}

impl UrdfUnit {
    /// Read and check a URDF file; meshes are looked for beside it.
    pub fn load(path: &Path) -> Result<Self, Error> {
        let file = File {
            path,
            text: read_text(path)?,
        };
        limits::check(&file)?;
        let robot = urdf_rs::read_from_string(&file.text)
            .map_err(|e| diagnostics::diagnose(&file, &e.to_string()))?;
        let order = tree(&file, &robot)?;
        lump(&file, &robot, &order)
    }

    /// The place of a link.
    pub fn place(&self, link: &str) -> Option<&LinkPlace> {
        self.places.iter().find(|p| p.link == link)
    }
}

fn lump(file: &File<'_>, robot: &Robot, order: &[Branch]) -> Result<UrdfUnit, Error> {
    let mut unit = UrdfUnit {
        bodies: Vec::new(),
        places: Vec::new(),
        friction_wheels: Vec::new(),
    };
    let mut place_of = vec![0; robot.links.len()];
    for (l, j) in order {
        let link = &robot.links[*l];
        let joint = j.map(|j| &robot.joints[j]);
        let (body, pose) = match joint {
            None => (
                unit.start_body(link, Isometry3::identity()),
                Isometry3::identity(),
            ),
            Some(joint) => {
                let parent = order
                    .iter()
                    .find(|(p, _)| robot.links[*p].name == joint.parent.link)
                    .map_or(0, |(p, _)| place_of[*p]);
                let parent = unit.places[parent].clone();
                let pose = parent.pose * file.pose("joint", &joint.name, &joint.origin)?;
                if joint_floats(file, joint)? {
                    let in_unit = unit.bodies[parent.body].pose * pose;
                    (unit.start_body(link, in_unit), Isometry3::identity())
                } else {
                    (parent.body, pose)
                }
            }
        };
        let mass = link_mass(file, link)?.map(|m| m.seen_from(&pose));
        if let Some(m) = &mass {
            unit.bodies[body].mass = unit.bodies[body].mass.plus(m);
        }
        let mut shapes = geometry::shapes(file, robot, link, &pose)?;
        let radius_m = shapes.iter().find_map(|s| match s.geometry {
            Geometry::Cylinder(radius, _) => Some(radius),
            _ => None,
        });
        place_of[*l] = unit.places.len();
        unit.places.push(LinkPlace {
            link: link.name.clone(),
            body,
            pose,
            mass,
            radius_m,
        });
        if let Some(joint) = joint.filter(|joint| joint.joint_type == JointType::Continuous) {
            let wheel = friction_wheel(
                file,
                joint,
                unit.places.len() - 1,
                &unit.places[place_of[*l]],
            )?;
            geometry::check_wheel(file, link, &shapes, &pose.translation.vector, &wheel.axle)?;
            let side = usize::from(pose.translation.y < 0.0);
            shapes.iter_mut().for_each(|s| s.spins = Some((0, side)));
            unit.friction_wheels.push(wheel);
        }
        unit.bodies[body].shapes.extend(shapes);
    }
    match unit.bodies.iter().find(|b| b.mass.mass_kg <= 0.0) {
        Some(b) => Err(file.fault(
            "link",
            &b.root,
            "the body that begins with this link has no mass",
            "give one of its links an <inertial>",
        )),
        None => Ok(unit),
    }
}

impl UrdfUnit {
    fn start_body(&mut self, link: &Link, pose: Isometry3<f64>) -> usize {
        self.bodies.push(UrdfBody {
            root: link.name.clone(),
            pose,
            mass: MassProperties::zero(),
            shapes: Vec::new(),
        });
        self.bodies.len() - 1
    }
}

/// True if the child of a joint is a body of its own.
fn joint_floats(file: &File<'_>, joint: &Joint) -> Result<bool, Error> {
    match joint.joint_type {
        JointType::Floating => Ok(true),
        JointType::Fixed | JointType::Continuous | JointType::Revolute | JointType::Prismatic => Ok(false),
        JointType::Planar | JointType::Spherical => Err(file.fault(
            "joint",
            &joint.name,
            "monorig does not support planar and spherical joints",
            "fixed, continuous (friction wheel), revolute and prismatic (held at rest), or floating (a body of its own)",
        )),
    }
}

/// Mass properties in the link frame; none for a pure frame.
fn link_mass(file: &File<'_>, link: &Link) -> Result<Option<MassProperties>, Error> {
    let given = &link.inertial;
    let j = &given.inertia;
    let numbers = [given.mass.value, j.ixx, j.ixy, j.ixz, j.iyy, j.iyz, j.izz];
    if numbers == [0.0; 7] {
        if link.visual.is_empty() && link.collision.is_empty() {
            return Ok(None);
        }
        let help = "a link with a shape needs <inertial> with mass and inertia; only a pure frame has none";
        return Err(file.fault("link", &link.name, "<inertial> is missing", help));
    }
    let own = MassProperties {
        mass_kg: given.mass.value,
        com: Vector3::zeros(),
        inertia: Matrix3::new(
            j.ixx, j.ixy, j.ixz, j.ixy, j.iyy, j.iyz, j.ixz, j.iyz, j.izz,
        ),
    };
    let help = "use a mass in kg above zero, and the inertia in kg·m² of a real body about its centre of mass";
    match own.flaw() {
        Some(flaw) => Err(file.fault("link", &link.name, flaw, help)),
        None if numbers.iter().any(|x| x.abs() > 1e9) => {
            Err(file.fault("link", &link.name, "a number beyond 1e9", help))
        }
        None => Ok(Some(own.seen_from(&file.pose(
            "link",
            &link.name,
            &given.origin,
        )?))),
    }
}

fn friction_wheel(
    file: &File<'_>,
    joint: &Joint,
    index: usize,
    place: &LinkPlace,
) -> Result<FrictionWheel, Error> {
    let fault = |message: &str, help: &str| file.fault("joint", &joint.name, message, help);
    let axis = Vector3::from(joint.axis.xyz.0);
    let axle = axis
        .try_normalize(1e-9)
        .filter(|a| a.iter().all(|x| x.is_finite()))
        .ok_or_else(|| {
            fault(
                "the axis has no direction",
                "<axis xyz=\"0 0 1\"/> for a friction wheel on an upright axle",
            )
        })?;
    let mass = place.mass.ok_or_else(|| {
        fault(
            "a friction wheel needs mass and inertia",
            "give the child link an <inertial>",
        )
    })?;
    let limit = &joint.limit;
    if !(limit.velocity > 0.0 && limit.effort > 0.0) {
        return Err(fault(
            "a friction wheel needs its limits",
            "<limit effort=\"N·m\" velocity=\"rad/s\"/>, both above zero",
        ));
    }
    let axle = place.pose.rotation * axle;
    if axle.z.abs() < 1.0 - 1e-9 {
        return Err(fault(
            "the axle is not upright",
            "friction wheels press on the web from both sides: their axles are vertical",
        ));
    }
    Ok(FrictionWheel {
        place: index,
        axle,
        inertia: axle.dot(&(mass.inertia * axle)),
        rate_max_radps: limit.velocity,
        torque_max_nm: limit.effort,
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
pub(crate) mod tests;
