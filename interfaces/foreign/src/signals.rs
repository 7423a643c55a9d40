//! Names of an estimator's inputs and outputs in an FMU: measured quantities and estimate, with an axis or the number
//! of a drive unit.

use monorig_estimators::api::signals::{Estimate, Shape, Slot, Value};

/// An estimated quantity: its value is `NAME`, its standard deviation `NAME_sd`, its mark `NAME_valid`.
pub struct Quantity {
    /// The name.
    pub name: &'static str,
    /// Unit of value and standard deviation.
    pub unit: &'static str,
    /// Description in one sentence.
    pub about: &'static str,
    /// Returns the place of the value in an estimate.
    pub at: fn(&mut Estimate) -> &mut Value,
}

/// The estimated quantities.
pub const QUANTITIES: [Quantity; 4] = [
    Quantity {
        name: "total_mass",
        unit: "kg",
        about: "Estimated total mass.",
        at: |e| &mut e.total_mass_kg,
    },
    Quantity {
        name: "grade",
        unit: "rad",
        about: "Estimated grade at the IMU, + uphill.",
        at: |e| &mut e.grade_rad,
    },
    Quantity {
        name: "effective_grade",
        unit: "rad",
        about: "Estimated effective grade of the whole train.",
        at: |e| &mut e.effective_grade_rad,
    },
    Quantity {
        name: "speed",
        unit: "m/s",
        about: "Estimated speed along the rail.",
        at: |e| &mut e.speed_mps,
    },
];

/// Another number of an estimate: its name, unit, description, and place.
pub type EstimatedNumber = (
    &'static str,
    &'static str,
    &'static str,
    fn(&mut Estimate) -> &mut f64,
);

const LAST: &str = "Innovation or NIS of the slope filter's last measurement.";
const LEVEL: &str = "Protection level of an estimate; 0 is none.";

/// Other numbers of an estimate.
pub const NUMBERS: [EstimatedNumber; 5] = [
    ("innovation", "1", LAST, |e| &mut e.innovation),
    ("nis", "1", LAST, |e| &mut e.nis),
    ("total_mass_protection", "kg", LEVEL, |e| {
        &mut e.protection.total_mass_kg
    }),
    ("grade_protection", "rad", LEVEL, |e| {
        &mut e.protection.grade_rad
    }),
    ("effective_grade_protection", "rad", LEVEL, |e| {
        &mut e.protection.effective_grade_rad
    }),
];

/// A name and the place of a flag in an estimate.
pub type EstimatedFlag = (&'static str, fn(&mut Estimate) -> &mut bool);

/// Flags of an estimate.
pub const FLAGS: [EstimatedFlag; 3] = [
    ("moving", |e| &mut e.flags.moving),
    ("excited", |e| &mut e.flags.excited),
    ("saturated", |e| &mut e.flags.saturated),
];

/// Output that is true if the last step was refused: the estimate is that before, marked not valid.
pub const REFUSED: &str = "refused";
/// Parameter that makes a sample new where its stamp has changed, and not at every step.
pub const STAMPED: &str = "stamped";
/// Command of the clamp cylinder pressure, MPa.
pub const CLAMP_COMMAND: &str = "command_clamp_pressure";
/// Command of the share of the clamp-brake force.
pub const BRAKE_COMMAND: &str = "command_brake";

/// Name of the torque command of a drive unit, counted from 0.
pub fn torque_command(index: usize) -> String {
    format!("command_motor_torque[{}]", index + 1)
}

/// Names of the values of a sample.
pub fn value_names(slot: Slot) -> Vec<String> {
    let name = slot.name();
    match slot.measurand.shape() {
        Shape::Vector => ["x", "y", "z"].map(|a| format!("{name}_{a}")).to_vec(),
        Shape::Scalar => vec![name.to_owned()],
        Shape::PerDrive | Shape::Auxiliary => vec![format!("{name}[{}]", slot.index + 1)],
    }
}

/// Name of the stamp of a sample, s.
pub fn stamp_name(slot: Slot) -> String {
    let name = slot.name();
    match slot.measurand.shape() {
        Shape::Vector | Shape::Scalar => format!("{name}_t"),
        Shape::PerDrive | Shape::Auxiliary => format!("{name}_t[{}]", slot.index + 1),
    }
}
