//! The plant: the interface between physics and everything else, [`Command`] in, [`Truth`] out.
//!
//! | module | what it holds |
//! |---|---|
//! | `rapier` | the train as rigid bodies |
//! | `train` | forces on and in the train, one law a file |
//! | `point_mass` | the train as a point on the rail |
//! | `divergence` | a plant that diverges ends the run |
//! | `options` | how a plant starts, and what surrounds it |
//! | `obstacles` | boxes beside the rail |

pub(crate) mod divergence;
pub mod obstacles;
mod options;
pub mod point_mass;
pub mod rapier;
pub mod train;

pub use options::{PlantOptions, PlantSetup};

use self::train::balance::ForceBalance;
use crate::error::Error;
use monorig_estimators::api::signals::Command;
use nalgebra::{UnitQuaternion, Vector3};

/// Computes the motion of a train on a rail or a car on a road.
pub trait Plant {
    /// Advance by `dt_s` under a command held constant over the step.
    fn step(&mut self, command: &Command, dt_s: f64) -> Result<(), Error>;
    /// The true state now.
    fn truth(&self) -> &Truth;
    /// Change the mass of the load during a run (pick-up, set-down), kg. Mass that is hung on comes with `speed_mps`
    /// along the rail, without that with the motion of the load that is there; the two then have one velocity, their
    /// momentum together. Mass that is set down leaves with the motion of the load, so that nothing pushes the train.
    fn set_load_mass(&mut self, mass_kg: f64, speed_mps: Option<f64>);
    /// Limit the pressure the clamps can reach (a fault), MPa.
    fn set_clamp_limit(&mut self, mpa: f64);
    /// Update the clearance in the truth, which is costly; called before a row is recorded.
    fn update_clearance(&mut self) {}
    /// Body whose motion is not finite, else the fastest body; `None` if the plant has no bodies.
    fn diverging_body(&self) -> Option<&str> {
        None
    }
    /// Returns true for a recorded drive that is played back: its motion comes from a log, and may be unknown.
    fn is_recorded(&self) -> bool {
        false
    }
    /// True at the end of a recording: a recorded drive that is played back is at its end, and the run has finished.
    fn is_over(&self) -> bool {
        false
    }
}

/// Motion of a point fixed to a body, in the world frame W (z up): the input of a sensor bolted there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MountState {
    /// Velocity of the point in the world, m/s.
    pub v_w: Vector3<f64>,
    /// Orientation of the mount frame (x forward, y left, z up) in the world.
    pub q_wm: UnitQuaternion<f64>,
    /// Angular velocity of the body, in the world, rad/s.
    pub w_w: Vector3<f64>,
}

/// One drive unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct DriveState {
    /// Chainage of the friction wheels, m.
    pub chainage_m: f64,
    /// Torque at the motor shaft, N·m.
    pub motor_torque_nm: f64,
    /// Rate of the friction wheels (left, right) at this instant, rad/s.
    pub wheel_rate_radps: [f64; 2],
    /// Angle of the friction wheels (left, right), rad, for viewing.
    pub wheel_angle_rad: [f64; 2],
    /// Friction force of both wheels on the train along the rail, N.
    pub traction_n: f64,
    /// Slip speed ωr − v, m/s, the larger of the two wheels.
    pub slip_mps: f64,
    /// Clamp cylinder pressure, MPa.
    pub clamp_mpa: f64,
    /// Adhesion coefficient under the wheels.
    pub adhesion: f64,
}

/// Truth that only a car has. Wheels: front left, front right, rear left, rear right.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct RoadState {
    /// Angle of the front wheels, rad, + left.
    pub steering_rad: f64,
    /// Distance to the left of the lane's middle, m.
    pub offset_m: f64,
    /// Heading against the lane, rad, + left.
    pub heading_rad: f64,
    /// Angle from the car's axis to its velocity, rad, + left; not a number below 0.1 m/s, where it has no direction.
    pub sideslip_rad: f64,
    /// Rate about the road's normal, rad/s, + left.
    pub yaw_rate_radps: f64,
    /// Force of the tyres to the left over the mass, m/s².
    pub lateral_mps2: f64,
    /// Loads of the wheels, N.
    pub wheel_load_n: [f64; 4],
}

/// Standard deviations of a measured reference: the references of a recorded drive. All zero in a simulation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct TruthSd {
    /// Standard deviation of the total mass, kg.
    pub total_mass_kg: f64,
    /// Standard deviation of the grade, rad.
    pub grade_rad: f64,
}

/// The true state at one instant: what sensors measure, and what controllers and estimators never get.
/// A plant of another crate starts from its default.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct Truth {
    /// Time since the start of the run, s.
    pub t_s: f64,
    /// Chainage of the IMU, m.
    pub chainage_m: f64,
    /// Speed of the train along the rail: the rate of `chainage_m`, m/s. What wheels on the rail measure, and what
    /// forces on the rail multiply to power. Of a car: speed of its centre of mass along the lane.
    pub speed_mps: f64,
    /// Change of `speed_mps` over the last step, m/s².
    pub accel_mps2: f64,
    /// Speed of the IMU itself along the rail, m/s. Below the rail it differs from `speed_mps` by the share height ×
    /// vertical curvature: less on a crest, more in a sag.
    pub speed_at_imu_mps: f64,
    /// Grade of the rail at the IMU's chainage, rad, + uphill (the primary slope truth). Kinks of rail joints are in
    /// it, their steps are not: a step of a millimetre is no grade.
    pub grade_at_imu_rad: f64,
    /// Pitch of the body that carries the IMU, rad, + nose up.
    pub pitch_at_imu_rad: f64,
    /// asin(Σ mᵢ sin θᵢ / Σ mᵢ) over all bodies, rad.
    pub grade_effective_rad: f64,
    /// Vertical curvature of the rail at the IMU, 1/m.
    pub curvature_vertical_1pm: f64,
    /// Horizontal curvature of the rail at the IMU, 1/m.
    pub curvature_horizontal_1pm: f64,
    /// Total mass, kg.
    pub total_mass_kg: f64,
    /// Load mass, kg.
    pub load_mass_kg: f64,
    /// Sum of friction forces of the driven wheels along the rail, N: after the rolling of the clamped wheels and what
    /// turns the wheels.
    pub traction_n: f64,
    /// Sum of running resistances against the motion, N, with the rolling of the clamped wheels, which lessens
    /// `traction_n` already: forces that add up are in `balance`.
    pub resistance_n: f64,
    /// Sum of clamp-brake forces, N.
    pub brake_n: f64,
    /// resistance / Σ mᵢ g cos θᵢ: the effective running-resistance coefficient.
    pub running_resistance: f64,
    /// Forces along the rail that add up to the change of momentum; none for a car.
    pub balance: Option<ForceBalance>,
    /// Swing angle of the load against the vertical of the beam, rad (longitudinal, lateral).
    pub sway_rad: [f64; 2],
    /// Largest distance of a rail-bound body from the rail's line, lateral and vertical, m.
    pub off_rail_m: f64,
    /// Least distance between train and obstacles, m; infinite when there are none.
    pub clearance_m: f64,
    /// Motion at each mount of the train, in the order of `Train::mounts`.
    pub mounts: Vec<MountState>,
    /// Drive units, front to rear.
    pub drives: Vec<DriveState>,
    /// Truth that only a car has; none for a train.
    pub road: Option<RoadState>,
    /// Pose of each body's origin in the world, in the order of `Train::bodies`.
    pub poses: Vec<(Vector3<f64>, UnitQuaternion<f64>)>,
    /// Standard deviations of the mass and of the grade above.
    pub sd: TruthSd,
}

impl Truth {
    /// A truth at rest with room for so many mounts, drives and bodies, and no obstacle near.
    pub(crate) fn with_room(mounts: usize, drives: usize, bodies: usize) -> Self {
        Self {
            mounts: vec![MountState::default(); mounts],
            drives: vec![DriveState::default(); drives],
            poses: vec![Default::default(); bodies],
            clearance_m: f64::INFINITY,
            ..Self::default()
        }
    }

    /// A truth in which only the time (s) is known, as for a recorded drive without references: every other number is
    /// not a number.
    pub fn unknown(t_s: f64) -> Self {
        let not = f64::NAN;
        Self {
            t_s,
            chainage_m: not,
            speed_mps: not,
            accel_mps2: not,
            speed_at_imu_mps: not,
            grade_at_imu_rad: not,
            pitch_at_imu_rad: not,
            grade_effective_rad: not,
            curvature_vertical_1pm: not,
            curvature_horizontal_1pm: not,
            total_mass_kg: not,
            load_mass_kg: not,
            traction_n: not,
            resistance_n: not,
            brake_n: not,
            running_resistance: not,
            balance: None,
            sway_rad: [not; 2],
            off_rail_m: not,
            clearance_m: not,
            mounts: Vec::new(),
            drives: Vec::new(),
            road: None,
            poses: Vec::new(),
            sd: TruthSd::default(),
        }
    }
}
