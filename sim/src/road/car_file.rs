//! The car file: the data of a car, with numbers whose range is checked while the file is read.

use crate::config::checked::{Fraction, NonNegative, Positive, Version1};
use crate::config::motor_file::MotorFile;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A car file, `assets/road/*.yaml`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CarFile {
    /// Format version, 1.
    pub(crate) version: Version1,
    /// Name of the car.
    pub(crate) name: String,
    /// Source of the figures.
    pub(crate) source: String,
    /// Mass and size.
    pub(crate) body: BodyFile,
    /// Axles and wheels.
    pub wheels: WheelsFile,
    /// Tyres.
    pub tyres: TyresFile,
    /// Motors and gears.
    pub(crate) motors: MotorsFile,
    /// Friction brakes.
    pub(crate) brakes: BrakesFile,
    /// Air drag.
    pub(crate) air: AirFile,
    /// Springs and dampers of the body.
    pub suspension: SuspensionFile,
    /// Driver.
    pub(crate) driver: DriverFile,
    /// Limits of the road for this car.
    pub(crate) limits: CarLimits,
}

/// Mass and size.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyFile {
    /// Mass of the car when driven, kg.
    pub mass_kg: Positive,
    /// Inertia about the vertical axis, kg·m².
    pub yaw_inertia_kgm2: Positive,
    /// Centre of gravity over the road, m.
    pub gravity_height_m: Positive,
    /// Length, width, height, m: for viewing.
    pub size_m: [Positive; 3],
}

/// Axles and wheels.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WheelsFile {
    /// From the centre of gravity forward to the front axle, m.
    pub front_axle_m: Positive,
    /// From the centre of gravity back to the rear axle, m.
    pub rear_axle_m: Positive,
    /// Distance of left and right wheels, m.
    pub track_width_m: Positive,
    /// Rolling radius, m.
    pub radius_m: Positive,
    /// Inertia of one wheel about its axle, kg·m².
    pub inertia_kgm2: Positive,
    /// Rolling resistance over load.
    pub rolling_resistance: NonNegative,
    /// Largest angle of the front wheels, degrees.
    pub steering_max_deg: Positive,
}

/// Tyres; stiffnesses are over the load, at the load the tyre carries on the level at rest.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TyresFile {
    /// Longitudinal force per unit of slip over load.
    pub slip_stiffness: Positive,
    /// Lateral force per radian over load, front tyres.
    pub cornering_stiffness_front: Positive,
    /// The same of the rear tyres.
    pub cornering_stiffness_rear: Positive,
    /// Share of the stiffness lost when the load doubles.
    pub load_loss: Fraction,
    /// Adhesion coefficient along the wheel on a clean dry road.
    pub adhesion_along: Positive,
    /// The same across.
    pub adhesion_across: Positive,
    /// Relaxation length, m.
    pub relaxation_m: Positive,
}

/// Motors and gears: one for each axle, half of its torque to each wheel.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotorsFile {
    /// Front motor.
    pub front: MotorFile,
    /// Rear motor.
    pub rear: MotorFile,
    /// Motor revolutions per wheel revolution.
    pub ratio: Positive,
    /// Share of power that the gear transmits when driving, and when braking.
    pub efficiency: Fraction,
}

/// Friction brakes.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BrakesFile {
    /// Largest force of all four at the road, N.
    pub force_max_n: NonNegative,
    /// Share of this force at the front axle.
    pub front_share: Fraction,
    /// First-order lag, s.
    pub lag_s: NonNegative,
}

/// Air drag ½ ρ c_D A v².
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AirFile {
    /// c_D.
    pub drag_coefficient: NonNegative,
    /// A, m².
    pub frontal_area_m2: NonNegative,
    /// ρ, kg/m³.
    pub density_kgpm3: NonNegative,
}

/// Springs and dampers of the body.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SuspensionFile {
    /// Pitch per longitudinal specific force, degrees per 9.81 m/s²; 0 = rigid.
    pub pitch_deg_per_g: NonNegative,
    /// Roll per lateral specific force, degrees per 9.81 m/s²; 0 = rigid.
    pub roll_deg_per_g: NonNegative,
    /// Share of the roll moment that the front axle carries.
    pub front_roll_share: Fraction,
    /// Undamped natural frequency of pitch and roll, Hz.
    pub frequency_hz: Positive,
    /// Damping ratio.
    pub damping: NonNegative,
}

/// Who steers: along the middle of the lane.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DriverFile {
    /// Lookahead distance of the driver, m.
    pub lookahead_m: Positive,
    /// Steering per metre beside the middle, rad/m.
    pub gain_radpm: Positive,
    /// First-order lag of driver and steering gear, s.
    pub lag_s: NonNegative,
}

/// Limits of the road for this car.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CarLimits {
    /// Least horizontal radius, m.
    pub min_radius_horizontal_m: Positive,
    /// Least vertical radius, m.
    pub min_radius_vertical_m: Positive,
    /// Steepest grade, degrees.
    pub max_grade_deg: Positive,
    /// Highest speed, m/s.
    pub max_speed_mps: Positive,
}
