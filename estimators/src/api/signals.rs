//! What crosses the border between the rig and an estimator: measurements and commands in, estimates out.

use crate::api::snapshot::state;
pub use crate::api::vehicle::{RoadVehicle, Vehicle, VehicleData};
use crate::{Real, Time};

/// Most drive units a train may have.
pub const MAX_DRIVES: usize = 16;

/// Most readings of instruments of a user's own.
pub const MAX_AUXILIARY: usize = 4;

/// A measured value and the instant it was taken at, on the sensor's clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<T> {
    /// Instant the value was taken.
    pub t: Time,
    /// The value, in the unit of the field that holds it.
    pub value: T,
}

/// New samples since the last call. `None` = no new sample: rates differ, samples drop out, samples arrive late.
///
/// IMU axes: x forward (growing chainage), y left, z up, so a grade that grows shows as a *negative* rate about y.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measurements {
    /// Now.
    pub t: Time,
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

impl Measurements {
    /// No sample, at this instant.
    pub fn at(t: Time) -> Self {
        Self {
            t,
            ..Self::default()
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

/// An estimated quantity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Value {
    /// The estimate, in the unit of the field that holds it. Always finite.
    pub value: Real,
    /// Its standard deviation, same unit. Always finite and not negative.
    pub sd: Real,
    /// Whether it is fit for use, by the one validity rule of all supervised estimators ([`crate::detect::validity`]): initialised, its
    /// inputs fresh, its standard deviation below the limit of its quantity, no clamp acting on it, the windowed NIS of its sources on the
    /// un-adapted noise within its χ² limit, its instruments plausible. Published methods without supervision mark what they have found at
    /// all.
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
    /// Instant the estimate is for.
    pub t: Time,
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
    /// Nothing valid yet, at this instant.
    pub fn at(t: Time) -> Self {
        Self {
            t,
            ..Self::default()
        }
    }

    /// Whether every number of it is finite.
    pub fn is_finite(&self) -> bool {
        let values = [
            self.total_mass_kg,
            self.grade_rad,
            self.effective_grade_rad,
            self.speed_mps,
        ];
        values
            .iter()
            .all(|v| v.value.is_finite() && v.sd.is_finite())
            && self.innovation.is_finite()
            && self.nis.is_finite()
    }
}
state!(Value { value, sd, valid; } where |this| this.sd >= 0.0);
