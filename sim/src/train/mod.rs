//! Data model of the train: rigid bodies, connections, drives, mounts, limits.

pub(crate) mod inertia;
pub(crate) mod mass_distribution;
pub(crate) mod step_check;
pub(crate) mod support_tree;

use crate::error::DataError;
use inertia::MassProperties;
use nalgebra::{Isometry3, Matrix3, Vector3};

/// A train ready to be put on a rail. Body frames: x forward, y left, z up.
#[derive(Clone, Debug, Default)]
pub struct Train {
    /// Name of the consist.
    pub name: String,
    /// One rigid body each: unit by unit from front to rear (a suspended unit, then its trolleys), the load last.
    pub bodies: Vec<Body>,
    /// Couplings, hangers, chains between bodies.
    pub connections: Vec<Connection>,
    /// Drive units, front to rear.
    pub drives: Vec<Drive>,
    /// Every URDF link as a place where a sensor can sit, named `unit/link`.
    pub mounts: Vec<Mount>,
    /// Index of the load's body.
    pub load: Option<usize>,
    /// What the load's body is made of.
    pub payload: Option<Payload>,
    /// What the train can run on.
    pub limits: Limits,
    /// Running resistance.
    pub resistance: Resistance,
}

/// A rigid body.
#[derive(Clone, Debug)]
pub struct Body {
    /// `unit` or `unit/link` for suspended parts.
    pub name: String,
    /// Mass, kg.
    pub mass_kg: f64,
    /// Centre of mass in the body frame, m.
    pub com: Vector3<f64>,
    /// Inertia tensor about the centre of mass, body axes, kg·m².
    pub inertia: Matrix3<f64>,
    /// Where the body starts: chainage relative to the train's front (≤ 0), and pose of the body frame in the rail
    /// frame at that chainage (x along t, y along l, z along u).
    pub start_s: f64,
    /// See above.
    pub start_pose: Isometry3<f64>,
    /// Wheels that hold the body to the rail; empty for suspended bodies. Body frame origin of a rail-bound body = rail line.
    pub stations: Vec<Station>,
    /// Visible and collision shapes.
    pub shapes: Vec<Shape>,
}

/// A pair of running wheels and the guide wheels beside it, at one place along a rail-bound body.
#[derive(Clone, Copy, Debug)]
pub struct Station {
    /// Place along the body, m.
    pub x_m: f64,
    /// Distance of the running-wheel contacts left and right of the rail's line, m.
    pub(crate) half_gauge_m: f64,
    /// Radius of the running wheels, m.
    pub wheel_radius_m: f64,
    /// Stiffness and damping of one running wheel, N/m and N·s/m.
    pub wheel_k: f64,
    /// See above.
    pub(crate) wheel_c: f64,
    /// Play of the hold-down side, m.
    pub(crate) holddown_play_m: f64,
    /// Stiffness and damping of the guide wheels, N/m and N·s/m.
    pub(crate) guide_k: f64,
    /// See above.
    pub(crate) guide_c: f64,
    /// Height of the guide wheels' contact in the body frame, m.
    pub(crate) guide_z_m: f64,
}

/// A spring-damper between two bodies.
#[derive(Clone, Copy, Debug)]
pub struct Connection {
    /// What it can carry.
    pub kind: ConnectionKind,
    /// Index of the bodies.
    pub a: usize,
    /// See above.
    pub b: usize,
    /// Anchors in the body frames, m.
    pub anchor_a: Vector3<f64>,
    /// See above.
    pub anchor_b: Vector3<f64>,
    /// Stiffness, N/m, and damping, N·s/m.
    pub k: f64,
    /// See above.
    pub c: f64,
    /// Free length, m (drawbars and chains).
    pub length_m: f64,
}

/// What a connection can carry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConnectionKind {
    /// Push and pull along the line between the anchors.
    Drawbar,
    /// Holds the anchors together in all directions (a ball joint).
    Hanger,
    /// Pull only.
    Chain,
}

/// The load's body: lifting gear, which is tare, and a payload on it that comes and goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Payload {
    /// Mass of the payload now, kg; 0 = empty hook.
    pub(crate) mass_kg: f64,
    /// The payload at its nominal mass, in the body frame; another mass has the same shape and centre.
    pub nominal: MassProperties,
    /// Spreader, hooks and chains, in the body frame.
    pub(crate) gear: MassProperties,
}

impl Payload {
    /// The load's body with this payload mass, in the body frame.
    pub(crate) fn body_with(&self, mass_kg: f64) -> MassProperties {
        self.gear.plus(&self.nominal.scaled_to(mass_kg))
    }
}

impl Train {
    /// Mass of everything, kg.
    pub fn total_mass_kg(&self) -> f64 {
        self.bodies.iter().map(|b| b.mass_kg).sum()
    }

    /// Mass of the payload, kg.
    pub(crate) fn load_mass_kg(&self) -> f64 {
        self.payload.map_or(0.0, |p| p.mass_kg)
    }

    /// Mass without payload, kg; the lifting gear counts as tare.
    pub fn tare_kg(&self) -> f64 {
        let empty_load = |i| {
            self.payload
                .filter(|_| self.load == Some(i))
                .map(|p| p.gear.mass_kg)
        };
        self.bodies
            .iter()
            .enumerate()
            .map(|(i, b)| empty_load(i).unwrap_or(b.mass_kg))
            .sum()
    }

    /// Rotating masses reflected to the rim, Σ (2 J_wheel + i² J_motor) / r², kg.
    pub fn rotating_mass_kg(&self) -> f64 {
        let reflected = |d: &Drive| {
            let inertia = 2.0 * d.wheel_inertia + d.gear_ratio * d.gear_ratio * d.motor_inertia;
            inertia / (d.wheel_radius_m * d.wheel_radius_m)
        };
        self.drives.iter().map(reflected).sum()
    }

    /// The same train with another payload, kg; 0 = empty hook.
    pub fn with_load_mass(mut self, mass_kg: f64) -> Result<Self, DataError> {
        let max = self.limits.max_load_kg;
        if !(0.0..=max).contains(&mass_kg) {
            let message = format!("a load of {mass_kg} kg on a train rated for {max} kg");
            return Err(DataError::new(
                "limits.max_load_kg",
                message,
                format!("a load mass from 0 to {max} kg"),
            ));
        }
        let (Some(index), Some(payload)) = (self.load, &mut self.payload) else {
            let help = "give the train file a `load`, or leave the load mass out";
            return if mass_kg == 0.0 {
                Ok(self)
            } else {
                Err(DataError::new("load", "this train carries no load", help))
            };
        };
        payload.mass_kg = mass_kg;
        let now = payload.body_with(mass_kg);
        let body = &mut self.bodies[index];
        (body.mass_kg, body.com, body.inertia) = (now.mass_kg, now.com, now.inertia);
        Ok(self)
    }

    /// Index of a mount by its full name `unit/link`; a bare `link` means the first that has it.
    pub(crate) fn mount(&self, name: &str) -> Option<usize> {
        let full = self.mounts.iter().position(|m| m.name == name);
        full.or_else(|| {
            self.mounts
                .iter()
                .position(|m| m.name.rsplit('/').next() == Some(name))
        })
    }
}

/// A drive unit: two friction wheels clamped to the web, one motor.
#[derive(Clone, Copy, Debug)]
pub struct Drive {
    /// Index of its body.
    pub body: usize,
    /// Place of the friction-wheel contact in the body frame (midway between the wheels), m.
    pub contact: Vector3<f64>,
    /// Friction-wheel radius, m.
    pub wheel_radius_m: f64,
    /// Inertia of one friction wheel about its axle, kg·m².
    pub wheel_inertia: f64,
    /// Inertia of the motor, kg·m² at the motor shaft.
    pub motor_inertia: f64,
    /// Motor revolutions per wheel revolution.
    pub gear_ratio: f64,
    /// Share of power that passes the gear when driving, and when braking.
    pub efficiency_drive: f64,
    /// See above.
    pub efficiency_brake: f64,
    /// Motor map: largest torque N·m, rated power W, largest speed rad/s, first-order lag s, torque rate N·m/s.
    pub torque_max_nm: f64,
    /// See above.
    pub power_w: f64,
    /// See above.
    pub speed_max_radps: f64,
    /// See above.
    pub lag_s: f64,
    /// See above.
    pub rate_nmps: f64,
    /// Clamp: piston area of the pair m² (each wheel is pressed with pressure × this area), nominal pressure MPa, lag s.
    pub piston_area_m2: f64,
    /// See above.
    pub clamp_mpa: f64,
    /// See above.
    pub clamp_lag_s: f64,
    /// LuGre: adhesion coefficient, bristle stiffness N/m, bristle damping N·s/m, rolling term κ 1/m.
    pub adhesion: f64,
    /// See above.
    pub sigma0: f64,
    /// See above.
    pub sigma1: f64,
    /// See above.
    pub kappa: f64,
    /// Clamp brake of the unit: largest force N, lag s.
    pub brake_max_n: f64,
    /// See above.
    pub brake_lag_s: f64,
}

/// A named place on a body.
#[derive(Clone, Debug)]
pub struct Mount {
    /// `unit/link`.
    pub(crate) name: String,
    /// Index of the body.
    pub(crate) body: usize,
    /// Pose of the mount frame in the body frame.
    pub(crate) pose: Isometry3<f64>,
}

/// What the train can run on.
#[derive(Clone, Copy, Debug, Default)]
pub struct Limits {
    /// Least horizontal radius, m.
    pub min_radius_horizontal_m: f64,
    /// Least vertical radius, m.
    pub min_radius_vertical_m: f64,
    /// Steepest grade, rad.
    pub max_grade_rad: f64,
    /// Highest speed, m/s.
    pub max_speed_mps: f64,
    /// Distance from the foremost to the rearmost wheel, m.
    pub length_m: f64,
    /// Rated load, kg.
    pub max_load_kg: f64,
}

/// Running resistance, each term of its own.
#[derive(Clone, Copy, Debug, Default)]
pub struct Resistance {
    /// Rolling of the clamped friction wheels, per newton of clamp force.
    pub clamped_wheel: f64,
    /// Rolling of the running wheels, per newton of wheel load.
    pub running_wheel: f64,
    /// Rolling of the guide wheels, per newton of guide force.
    pub guide_wheel: f64,
    /// Bearings: constant force per rail-bound body, N, and N·s/m.
    pub bearing_n: f64,
    /// See above.
    pub bearing_nspm: f64,
    /// Air drag ½ρ c_D A, N·s²/m².
    pub air_nspm2: f64,
}

/// A visible and touchable shape on a body.
#[derive(Clone, Debug)]
pub struct Shape {
    /// The URDF link it stands for.
    pub link: String,
    /// Pose in the body frame.
    pub pose: Isometry3<f64>,
    /// The shape.
    pub geometry: Geometry,
    /// Colour, linear RGBA 0…1.
    pub rgba: [f32; 4],
    /// Whether it takes part in collisions and clearance.
    pub collides: bool,
    /// Set for a friction wheel: (index of the drive, 0 left / 1 right): it turns with the wheel, about its own z axis.
    pub spins: Option<(usize, usize)>,
}

/// Primitive shapes, and meshes.
#[derive(Clone, Debug)]
pub enum Geometry {
    /// Full edge lengths, m.
    Box(Vector3<f64>),
    /// Radius and length, m; axis along z.
    Cylinder(f64, f64),
    /// Radius, m.
    Sphere(f64),
    /// Triangles.
    Mesh {
        /// Vertices, m.
        vertices: Vec<[f64; 3]>,
        /// Triangles.
        triangles: Vec<[u32; 3]>,
    },
}
