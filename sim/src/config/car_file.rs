//! The car file: its format, and how it becomes a [`Car`].

use crate::config::checked::{Fraction, NonNegative, Positive, Version1};
use crate::config::file::{Sets, read_yaml_with, with_sets};
use crate::config::motor_file::MotorFile;
use crate::error::Error;
use crate::plant::road::car::Car;
use crate::plant::road::spec::{
    AirSpec, AxlesSpec, BodySpec, BrakesSpec, CarSpec, DriverSpec, LimitsSpec, MotorSpec,
    MotorsSpec, SuspensionSpec, TyresSpec,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A car file, `assets/road/*.yaml`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CarFile {
    /// Format version, 1.
    pub version: Version1,
    /// Name of the car.
    pub name: String,
    /// Where the figures come from.
    pub source: String,
    /// Mass and size.
    pub body: BodyFile,
    /// Axles and wheels.
    pub wheels: WheelsFile,
    /// Tyres.
    pub tyres: TyresFile,
    /// Motors and gears.
    pub motors: MotorsFile,
    /// Friction brakes.
    pub brakes: BrakesFile,
    /// Air drag.
    pub air: AirFile,
    /// Springs and dampers of the body.
    pub suspension: SuspensionFile,
    /// Who steers.
    pub driver: DriverFile,
    /// What the car can run on.
    pub limits: CarLimits,
}

/// Mass and size.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyFile {
    /// Mass as it is driven, kg.
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
    /// Share of power that passes when driving, and when braking.
    pub efficiency: Fraction,
}

/// Friction brakes.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BrakesFile {
    /// Largest force of all four at the road, N.
    pub force_max_n: NonNegative,
    /// Share of it at the front axle.
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
    /// How far ahead the driver looks, m.
    pub lookahead_m: Positive,
    /// Steering per metre beside the middle, rad/m.
    pub gain_radpm: Positive,
    /// First-order lag of driver and steering gear, s.
    pub lag_s: NonNegative,
}

/// What the car can run on.
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

impl Car {
    /// Read and check a car file.
    pub fn load(path: &Path) -> Result<Self, Error> {
        Self::load_with(path, &Sets::default())
    }

    /// The same with changes made to the file.
    pub fn load_with(path: &Path, sets: &Sets) -> Result<Self, Error> {
        let file: CarFile = read_yaml_with(path, sets)?;
        Self::new(file.into()).map_err(|e| with_sets(e.in_file(path), sets))
    }
}

impl From<CarFile> for CarSpec {
    fn from(f: CarFile) -> Self {
        Self {
            name: f.name,
            body: f.body.into(),
            wheels: f.wheels.into(),
            tyres: f.tyres.into(),
            motors: f.motors.into(),
            brakes: f.brakes.into(),
            air: f.air.into(),
            suspension: f.suspension.into(),
            driver: f.driver.into(),
            limits: f.limits.into(),
        }
    }
}

impl From<BodyFile> for BodySpec {
    fn from(f: BodyFile) -> Self {
        Self {
            mass_kg: f.mass_kg.get(),
            yaw_inertia_kgm2: f.yaw_inertia_kgm2.get(),
            gravity_height_m: f.gravity_height_m.get(),
            size_m: f.size_m.map(f64::from),
        }
    }
}

impl From<WheelsFile> for AxlesSpec {
    fn from(f: WheelsFile) -> Self {
        Self {
            front_axle_m: f.front_axle_m.get(),
            rear_axle_m: f.rear_axle_m.get(),
            track_width_m: f.track_width_m.get(),
            radius_m: f.radius_m.get(),
            inertia_kgm2: f.inertia_kgm2.get(),
            rolling_resistance: f.rolling_resistance.get(),
            steering_max_deg: f.steering_max_deg.get(),
        }
    }
}

impl From<TyresFile> for TyresSpec {
    fn from(f: TyresFile) -> Self {
        Self {
            slip_stiffness: f.slip_stiffness.get(),
            cornering_stiffness_front: f.cornering_stiffness_front.get(),
            cornering_stiffness_rear: f.cornering_stiffness_rear.get(),
            load_loss: f.load_loss.get(),
            adhesion_along: f.adhesion_along.get(),
            adhesion_across: f.adhesion_across.get(),
            relaxation_m: f.relaxation_m.get(),
        }
    }
}

impl From<MotorsFile> for MotorsSpec {
    fn from(f: MotorsFile) -> Self {
        Self {
            front: f.front.into(),
            rear: f.rear.into(),
            ratio: f.ratio.get(),
            efficiency: f.efficiency.get(),
        }
    }
}

impl From<MotorFile> for MotorSpec {
    fn from(f: MotorFile) -> Self {
        Self {
            torque_max_nm: f.torque_max_nm.get(),
            power_kw: f.power_kw.get(),
            speed_max_rpm: f.speed_max_rpm.get(),
            inertia_kgm2: f.inertia_kgm2.get(),
            lag_s: f.lag_s.get(),
            torque_rate_nmps: f.torque_rate_nmps.get(),
        }
    }
}

impl From<BrakesFile> for BrakesSpec {
    fn from(f: BrakesFile) -> Self {
        Self {
            force_max_n: f.force_max_n.get(),
            front_share: f.front_share.get(),
            lag_s: f.lag_s.get(),
        }
    }
}

impl From<AirFile> for AirSpec {
    fn from(f: AirFile) -> Self {
        Self {
            drag_coefficient: f.drag_coefficient.get(),
            frontal_area_m2: f.frontal_area_m2.get(),
            density_kgpm3: f.density_kgpm3.get(),
        }
    }
}

impl From<SuspensionFile> for SuspensionSpec {
    fn from(f: SuspensionFile) -> Self {
        Self {
            pitch_deg_per_g: f.pitch_deg_per_g.get(),
            roll_deg_per_g: f.roll_deg_per_g.get(),
            front_roll_share: f.front_roll_share.get(),
            frequency_hz: f.frequency_hz.get(),
            damping: f.damping.get(),
        }
    }
}

impl From<DriverFile> for DriverSpec {
    fn from(f: DriverFile) -> Self {
        Self {
            lookahead_m: f.lookahead_m.get(),
            gain_radpm: f.gain_radpm.get(),
            lag_s: f.lag_s.get(),
        }
    }
}

impl From<CarLimits> for LimitsSpec {
    fn from(f: CarLimits) -> Self {
        Self {
            min_radius_horizontal_m: f.min_radius_horizontal_m.get(),
            min_radius_vertical_m: f.min_radius_vertical_m.get(),
            max_grade_deg: f.max_grade_deg.get(),
            max_speed_mps: f.max_speed_mps.get(),
        }
    }
}
