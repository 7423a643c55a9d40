//! Data model of the train: rigid bodies, connections, drives, mounts, limits.

pub(crate) mod inertia;
pub(crate) mod mass_distribution;
pub(crate) mod springs;
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
    /// Parts of the load's body.
    pub payload: Option<Payload>,
    /// Limits of the track and of the load for this train.
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
    /// Chainage of the body at the start, relative to the train's front (≤ 0), m.
    pub start_s: f64,
    /// Pose of the body frame in the rail frame at that chainage (x along t, y along l, z along u).
    pub start_pose: Isometry3<f64>,
    /// Wheels that hold the body to the rail; empty for suspended bodies. Body frame origin of a rail-bound body = rail
    /// line.
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
    /// Stiffness of one running wheel, N/m.
    pub wheel_k: f64,
    /// Damping of one running wheel, N·s/m.
    pub(crate) wheel_c: f64,
    /// Play of the hold-down side, m.
    pub(crate) holddown_play_m: f64,
    /// Stiffness of the guide wheels, N/m.
    pub(crate) guide_k: f64,
    /// Damping of the guide wheels, N·s/m.
    pub(crate) guide_c: f64,
    /// Height of the guide wheels' contact in the body frame, m.
    pub(crate) guide_z_m: f64,
}

/// A spring-damper between two bodies.
#[derive(Clone, Copy, Debug)]
pub struct Connection {
    /// Forces that the connection can carry.
    pub kind: ConnectionKind,
    /// Index of the first body.
    pub a: usize,
    /// Index of the second body.
    pub b: usize,
    /// Anchor in the frame of the first body, m.
    pub anchor_a: Vector3<f64>,
    /// Anchor in the frame of the second body, m.
    pub anchor_b: Vector3<f64>,
    /// Stiffness, N/m.
    pub k: f64,
    /// Damping, N·s/m.
    pub c: f64,
    /// Free length, m (drawbars and chains).
    pub length_m: f64,
}

/// The forces that a connection can carry.
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

    /// Returns the same train with another payload, kg; 0 is an empty hook.
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

    /// Index of a mount by its full name `unit/link`; `link` alone means the first unit with this link.
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
#[derive(Clone, Copy, Debug, Default)]
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
    /// Share of power that passes the gear when driving.
    pub efficiency_drive: f64,
    /// Share of power that passes the gear when braking.
    pub efficiency_brake: f64,
    /// Largest torque of the motor, N·m.
    pub torque_max_nm: f64,
    /// Rated power of the motor, W.
    pub power_w: f64,
    /// Largest speed of the motor, rad/s.
    pub speed_max_radps: f64,
    /// First-order lag of the torque, s.
    pub lag_s: f64,
    /// Fastest change of the torque, N·m/s.
    pub rate_nmps: f64,
    /// Piston area of the pair of clamps, m². Each wheel is pressed with pressure × this area.
    pub piston_area_m2: f64,
    /// Nominal clamp pressure, MPa.
    pub clamp_mpa: f64,
    /// First-order lag of the clamp pressure, s.
    pub clamp_lag_s: f64,
    /// Adhesion coefficient.
    pub adhesion: f64,
    /// Bristle stiffness of the LuGre model, N/m.
    pub sigma0: f64,
    /// Bristle damping of the LuGre model, N·s/m.
    pub sigma1: f64,
    /// Rolling term κ of the LuGre model, 1/m.
    pub kappa: f64,
    /// Largest force of the unit's clamp brake, N.
    pub brake_max_n: f64,
    /// First-order lag of the clamp brake, s.
    pub brake_lag_s: f64,
}

/// Bristle damping of a brake shoe, N·s/m; its stiffness is that of the wheels.
pub(crate) const SHOE_SIGMA1: f64 = 2.0e4;

impl Drive {
    /// Inertia that turns with a friction wheel, half of the motor's included, kg·m².
    pub(crate) fn turning_inertia(&self) -> f64 {
        self.wheel_inertia + 0.5 * self.gear_ratio * self.gear_ratio * self.motor_inertia
    }
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

/// Limits of the track and of the load for this train.
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
    /// Constant bearing force of each rail-bound body, N.
    pub bearing_n: f64,
    /// Bearing force of each rail-bound body that grows with speed, N·s/m.
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
    /// True if it takes part in collisions and clearance.
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
