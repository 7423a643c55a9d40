//! What crosses the border between the rig and an estimator: measurements and commands in, estimates out.

use crate::api::snapshot::state;
use crate::{Real, Time};

/// Most drive units a train may have.
pub const MAX_DRIVES: usize = 16;

/// Most readings of instruments of a user's own.
pub const MAX_AUXILIARY: usize = 4;

/// A measured value and the instant it was taken at, on the sensor's clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<T> {
    /// Instant the value was taken, s since the start of the run.
    pub t_s: Time,
    /// The value, in the unit of the field that holds it.
    pub value: T,
}

/// New samples since the last call. `None` = no new sample: rates differ, samples drop out, samples arrive late.
///
/// IMU axes: x forward (growing chainage), y left, z up, so a grade that grows shows as a *negative* rate about y.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measurements {
    /// Now, s since the start of the run.
    pub t_s: Time,
    /// Specific force (acceleration minus gravity) in IMU axes, m/s².
    pub specific_force_mps2: Option<Sample<[Real; 3]>>,
    /// Angular rate in IMU axes, rad/s.
    pub angular_rate_radps: Option<Sample<[Real; 3]>>,
    /// Torque at the motor shaft of each drive unit, N·m.
    pub motor_torque_nm: [Option<Sample<Real>>; MAX_DRIVES],
    /// Circumferential speed of the friction wheels of each drive unit (rate × nominal radius), m/s.
    pub wheel_speed_mps: [Option<Sample<Real>>; MAX_DRIVES],
    /// Clamp cylinder pressure of each drive unit, MPa.
    pub clamp_pressure_mpa: [Option<Sample<Real>>; MAX_DRIVES],
    /// Steering angle of a road vehicle's front wheels, rad, + left. Never on a rail.
    pub steering_angle_rad: Option<Sample<Real>>,
    /// Pitch of the inclinometer against the apparent vertical, rad, + nose up: acceleration along the rail is in it.
    pub inclination_rad: Option<Sample<Real>>,
    /// Readings of instruments of a user's own, in the units they choose.
    pub auxiliary: [Option<Sample<Real>>; MAX_AUXILIARY],
}

impl Measurements {
    /// All slots with one value, in a fixed order.
    pub fn scalars(&self) -> impl Iterator<Item = &Option<Sample<Real>>> {
        let drives = self.motor_torque_nm.iter();
        drives
            .chain(&self.wheel_speed_mps)
            .chain(&self.clamp_pressure_mpa)
            .chain([&self.steering_angle_rad, &self.inclination_rad])
            .chain(&self.auxiliary)
    }

    /// The same slots to be written.
    pub fn scalars_mut(&mut self) -> impl Iterator<Item = &mut Option<Sample<Real>>> {
        let drives = self.motor_torque_nm.iter_mut();
        drives
            .chain(&mut self.wheel_speed_mps)
            .chain(&mut self.clamp_pressure_mpa)
            .chain([&mut self.steering_angle_rad, &mut self.inclination_rad])
            .chain(&mut self.auxiliary)
    }

    /// All slots with a vector, in a fixed order.
    pub fn vectors(&self) -> [&Option<Sample<[Real; 3]>>; 2] {
        [&self.specific_force_mps2, &self.angular_rate_radps]
    }

    /// The same slots to be written.
    pub fn vectors_mut(&mut self) -> [&mut Option<Sample<[Real; 3]>>; 2] {
        [&mut self.specific_force_mps2, &mut self.angular_rate_radps]
    }

    /// Whether there is any sample.
    pub fn any(&self) -> bool {
        self.vectors().iter().any(|v| v.is_some()) || self.scalars().any(Option::is_some)
    }

    /// Takes over the samples that `newer` has and keeps the others.
    pub fn merge(&mut self, newer: &Self) {
        for (old, new) in self.vectors_mut().into_iter().zip(newer.vectors()) {
            *old = new.or(*old);
        }
        for (old, new) in self.scalars_mut().zip(newer.scalars()) {
            *old = new.or(*old);
        }
    }
}

/// What the controller asks of the train.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Command {
    /// Motor torque of each drive unit, N·m at the motor shaft, + drives towards growing chainage.
    pub motor_torque_nm: [Real; MAX_DRIVES],
    /// Clamp cylinder pressure, MPa, all units.
    pub clamp_pressure_mpa: Real,
    /// Share of the clamp-brake force, 0 = released … 1 = fully applied.
    pub brake: Real,
}

/// What an estimator is told about the vehicle when it is built. Nominal values: the truth may differ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vehicle {
    /// Mass of the empty train, kg.
    pub tare_kg: Real,
    /// Number of drive units.
    pub drives: usize,
    /// Friction-wheel radius, m.
    pub wheel_radius_m: Real,
    /// Motor revolutions per wheel revolution.
    pub gear_ratio: Real,
    /// Share of motor power that reaches the rim when driving, 0…1.
    pub efficiency: Real,
    /// Rotating masses reflected to the rim, Σ J/r², kg.
    pub rotating_mass_kg: Real,
    /// Running-resistance coefficient, resistance / (total mass · g · cos θ).
    pub running_resistance: Real,
    /// Smallest and largest total mass thought possible, kg.
    pub mass_range_kg: [Real; 2],
    /// From where to where behind the middle of the unit that carries the IMU (towards falling chainage; negative = ahead of it) the
    /// tare is spread, m. Both 0: a point.
    pub tare_span_m: [Real; 2],
    /// The same for where the load's weight comes onto the rail, m.
    pub load_span_m: [Real; 2],
    /// How far ahead of that middle the IMU sits, m. It pitches with its unit, so it reads the grade under the middle.
    pub imu_arm_m: Real,
    /// What only a road vehicle has; `None` for a train.
    pub road: Option<RoadVehicle>,
}

/// What an estimator is told about a road vehicle beyond what a train has: drag, and a single-track model for bends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoadVehicle {
    /// Drag coefficient times frontal area, m².
    pub drag_area_m2: Real,
    /// Density of the air, kg/m³.
    pub air_density_kgpm3: Real,
    /// From the centre of gravity forward to the front axle, m.
    pub front_axle_m: Real,
    /// From the centre of gravity back to the rear axle, m.
    pub rear_axle_m: Real,
    /// Cornering stiffness of the front axle (both tyres), N/rad.
    pub front_cornering_npr: Real,
    /// Cornering stiffness of the rear axle (both tyres), N/rad.
    pub rear_cornering_npr: Real,
}

/// Speed, m/s, below which a vehicle counts as standing, on a rail and on a road: friction there is not the running resistance, and
/// a road vehicle's wheel speed tells less.
const STANDSTILL_MPS: [Real; 2] = [0.05, 0.3];

impl Vehicle {
    /// The speed below which the vehicle counts as standing, m/s: the one given, or what suits a rail or a road.
    pub fn standstill_mps(&self, given_mps: Option<Real>) -> Real {
        let [rail, road] = STANDSTILL_MPS;
        given_mps.unwrap_or(if self.road.is_some() { road } else { rail })
    }

    /// The mass to start from, kg: the one given, or the middle of the mass range; always inside the range.
    pub fn first_mass_kg(&self, given_kg: Option<Real>) -> Real {
        let [low, high] = self.mass_range_kg;
        let first = given_kg.unwrap_or(0.5 * (low + high));
        first.max(low).min(high)
    }
}

/// An estimated quantity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Value {
    /// The estimate, in the unit of the field that holds it. Always finite.
    pub value: Real,
    /// Its standard deviation, same unit. Always finite and not negative.
    pub sd: Real,
    /// Whether the estimator vouches for it: initialised and not saturated.
    pub valid: bool,
}

/// What an estimator says about its own working.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Flags {
    /// The train moves fast enough for the force balance to hold.
    pub moving: bool,
    /// The mass regression is excited and learns.
    pub excited: bool,
    /// A limit (mass range, covariance, noise clamp) acts.
    pub saturated: bool,
}

/// Output of one estimator step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Instant the estimate is for, s.
    pub t_s: Time,
    /// Total mass (tare + load), kg.
    pub total_mass_kg: Value,
    /// Grade angle at the IMU, rad, + uphill towards growing chainage.
    pub grade_rad: Value,
    /// Grade angle that the train as a whole feels, asin(Σ mᵢ sin θᵢ / Σ mᵢ), rad: what a speed control needs. The same as
    /// [`Estimate::grade_rad`] from an estimator that takes the train for a point.
    pub effective_grade_rad: Value,
    /// Speed along the rail, m/s.
    pub speed_mps: Value,
    /// Innovation of the slope filter's last measurement (m/s for wheel speed).
    pub innovation: Real,
    /// Normalised innovation squared of the same, dimensionless, 1 on average when consistent.
    pub nis: Real,
    /// Status.
    pub flags: Flags,
}

impl Estimate {
    /// Whether every number of it is finite.
    pub fn is_finite(&self) -> bool {
        let values = [
            self.total_mass_kg,
            self.grade_rad,
            self.effective_grade_rad,
            self.speed_mps,
        ];
        self.t_s.is_finite()
            && values
                .iter()
                .all(|v| v.value.is_finite() && v.sd.is_finite())
            && self.innovation.is_finite()
            && self.nis.is_finite()
    }
}
state!(Value { value, sd, valid; } where |this| this.sd >= 0.0);
