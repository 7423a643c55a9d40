//! Signals between the rig and an estimator: measurements and commands in, estimates out.

pub use crate::api::measurements::{
    MAX_AUXILIARY, MAX_DRIVES, Measurand, Measurements, Sample, Shape, Slot,
};
use crate::api::snapshot::state;
pub use crate::api::vehicle::{RoadVehicle, Vehicle, VehicleData};
use crate::{Real, Time};

/// Command of the controller to the train.
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
    /// Standard deviation, in the same unit. Always finite and not negative.
    pub sd: Real,
    /// True if the estimate can be used, by the common validity rule of all supervised estimators
    /// ([`crate::detect::validity`]): initialised, its inputs fresh, its standard deviation below the limit of its
    /// quantity, no clamp acting on it, the windowed NIS of its sources on the un-adapted noise within its χ² limit,
    /// its instruments plausible. Published methods without supervision mark what they have found at all.
    pub valid: bool,
}

impl Value {
    /// Builds an estimate from its value, its standard deviation in the same unit, and whether it can be used.
    pub const fn new(value: Real, sd: Real, valid: bool) -> Self {
        Self { value, sd, valid }
    }
}

/// Protection levels of an estimate: sizes that its errors are meant to exceed no more often than the risk that the
/// estimator is built for. 0 where an estimator has no level of its own: the rig then takes k standard deviations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Protection {
    /// Level of the total mass, kg.
    pub total_mass_kg: Real,
    /// Level of the grade at the IMU, rad.
    pub grade_rad: Real,
    /// Level of the effective grade, rad.
    pub effective_grade_rad: Real,
}

/// Status of an estimator.
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
    /// Instant of the estimate.
    pub t: Time,
    /// Total mass (tare + load), kg.
    pub total_mass_kg: Value,
    /// Grade angle at the IMU, rad, + uphill towards growing chainage.
    pub grade_rad: Value,
    /// Effective grade angle of the whole train, asin(Σ mᵢ sin θᵢ / Σ mᵢ), rad: what a speed control needs. The same as
    /// [`Estimate::grade_rad`] from an estimator that takes the train for a point.
    pub effective_grade_rad: Value,
    /// Speed along the rail, m/s.
    pub speed_mps: Value,
    /// Protection levels.
    pub protection: Protection,
    /// Innovation of the slope filter's last measurement (m/s for wheel speed).
    pub innovation: Real,
    /// Normalised innovation squared of the same, dimensionless, 1 on average when consistent.
    pub nis: Real,
    /// Status.
    pub flags: Flags,
}

impl Estimate {
    /// Makes an estimate without a valid value, at this instant.
    pub fn at(t: Time) -> Self {
        Self {
            t,
            ..Self::default()
        }
    }

    /// True if every number of the estimate is finite.
    pub fn is_finite(&self) -> bool {
        let values = [
            self.total_mass_kg,
            self.grade_rad,
            self.effective_grade_rad,
            self.speed_mps,
        ];
        let of = &self.protection;
        let levels = [of.total_mass_kg, of.grade_rad, of.effective_grade_rad];
        values
            .iter()
            .all(|v| v.value.is_finite() && v.sd.is_finite())
            && levels.iter().all(|level| level.is_finite())
            && self.innovation.is_finite()
            && self.nis.is_finite()
    }
}
state!(Value { value, sd, valid; } where |this| this.sd >= 0.0);
