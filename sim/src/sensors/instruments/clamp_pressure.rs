//! Clamp pressure: pressure in the clamp cylinder of a drive unit, MPa.

use super::drive_instruments::{DriveInstruments, DriveQuantity};
use crate::plant::DriveState;
use crate::sensors::InstrumentKind;
use crate::train::Drive;
use monorig_estimators::api::signals::Measurand;

/// The clamp pressure of every drive unit, as a data sheet names it.
pub const KIND: InstrumentKind = InstrumentKind {
    name: QUANTITY.name,
    unsuited: |car| car.then_some("a car has no clamps"),
    build: |spec, on| Ok(Box::new(DriveInstruments::new(QUANTITY, spec, on))),
};

const QUANTITY: DriveQuantity = DriveQuantity {
    name: "clamp_pressure",
    measurand: Measurand::ClampPressure,
    ideal,
};

/// The ideal value, MPa.
pub fn ideal(state: &DriveState, _nominal: &Drive) -> f64 {
    state.clamp_mpa
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensors::behaviour::train;

    #[test]
    fn it_is_the_pressure_in_the_cylinder() {
        let state = DriveState {
            clamp_mpa: 9.5,
            ..DriveState::default()
        };
        assert_eq!(ideal(&state, &train(1).drives[0]), 9.5);
    }
}
