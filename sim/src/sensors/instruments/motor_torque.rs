//! Motor torque: the torque at the motor shaft of a drive unit, N·m, + drives towards growing chainage.
//!
//! In practice an estimate from the inverter's current; its error is therefore mostly a share of the reading.

use super::drive_instruments::{DriveInstruments, DriveQuantity};
use crate::plant::DriveState;
use crate::sensors::InstrumentKind;
use crate::train::Drive;
use monorig_estimators::api::signals::Measurand;

/// The motor torque of every drive unit, as a data sheet names it.
pub const KIND: InstrumentKind = InstrumentKind {
    name: QUANTITY.name,
    unsuited: |_| None,
    build: |spec, on| Ok(Box::new(DriveInstruments::new(QUANTITY, spec, on))),
};

const QUANTITY: DriveQuantity = DriveQuantity {
    name: "motor_torque",
    measurand: Measurand::MotorTorque,
    ideal,
};

/// The ideal value, N·m.
pub fn ideal(state: &DriveState, _nominal: &Drive) -> f64 {
    state.motor_torque_nm
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensors::behaviour::train;

    #[test]
    fn it_is_the_torque_at_the_motor_not_at_the_wheel() {
        let state = DriveState {
            motor_torque_nm: -40.0,
            ..DriveState::default()
        };
        assert_eq!(ideal(&state, &train(1).drives[0]), -40.0);
    }
}
