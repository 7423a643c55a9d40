//! The instruments of monorig, one in each file: ideal physics, the measurand, construction. The list makes the data
//! sheet too.
//!
//! `mounted_instrument` is common to instruments bolted to a link, `drive_instruments` to those on every drive unit.
//! `mount` finds the link of the vehicle that a data sheet names.
//!
//! A further instrument is a row of the table of measured quantities (`measurements!` in the estimators' crate), a file
//! here with its [`InstrumentKind`], and a row of the list below.

pub mod accelerometer;
pub mod clamp_pressure;
mod drive_instruments;
pub mod gyro;
pub mod inclinometer;
pub mod motor_torque;
mod mount;
mod mounted_instrument;
pub mod steering_angle;
pub mod wheel_speed;

pub use mounted_instrument::MotionStep;

use super::instrument::InstrumentKind;
use super::spec::{InstrumentSpec, MountedSensor, PlainSensor};
use crate::checked::Version1;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

macro_rules! instruments {
    ($($(#[doc = $about:literal])+ $name:ident: $block:ty;)+) => {
        /// Kinds of instruments that a data sheet can name, in the order in which they are read in a step.
        pub const KINDS: &[InstrumentKind] = &[$($name::KIND),+];

        /// Keys of a data sheet that no other file has.
        pub const SHEET_KEYS: &[&str] = &["source", $(stringify!($name)),+];

        /// A sensor sheet file.
        #[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct SheetFile {
            /// Format version, 1.
            pub version: Version1,
            /// Source of the figures.
            pub source: String,
            $($(#[doc = $about])+ #[serde(default)] pub $name: Option<$block>,)+
        }

        impl SheetFile {
            /// The instruments that are fitted, by name, in the order of the list.
            pub fn fitted(&self) -> Vec<(&'static str, InstrumentSpec)> {
                let mut fitted = Vec::new();
                $(fitted.extend(self.$name.clone().map(|block| ($name::KIND.name, block.into())));)+
                fitted
            }
        }
    };
}

// A row: description, name, and block of the data sheet: with axes (`InstrumentSpec`), bolted to a link, or without a
// place of its own.
instruments! {
    /// Three-axis accelerometer, m/s².
    accelerometer: InstrumentSpec;
    /// Three-axis gyro, rad/s.
    gyro: InstrumentSpec;
    /// Torque at the motor shaft, one per drive unit, N·m.
    motor_torque: PlainSensor;
    /// Circumferential speed of the friction wheels, one per drive unit, m/s.
    wheel_speed: PlainSensor;
    /// Pressure in the clamp cylinder, one per drive unit, MPa.
    clamp_pressure: PlainSensor;
    /// Angle of the front wheels of a car, rad.
    steering_angle: PlainSensor;
    /// Pitch against the apparent vertical (of gravity and acceleration), rad.
    inclinometer: MountedSensor;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_instrument_is_called_as_its_key_in_the_sheet() {
        let names = KINDS.iter().map(|kind| kind.name);
        assert!(names.eq(SHEET_KEYS.iter().skip(1).copied()));
    }
}
