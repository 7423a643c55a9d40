//! Clamp pressure: pressure in the clamp cylinder of a drive unit, MPa.

use super::InstrumentKind;
use super::drive_instruments::{DriveInstruments, DriveQuantity};
use crate::plant::DriveState;
use crate::train::Drive;

/// The clamp pressure of every drive unit, as a data sheet names it.
pub const KIND: InstrumentKind = InstrumentKind {
    name: QUANTITY.name,
    unsuited: |car| car.then_some("a car has no clamps"),
    build: |spec, on| Ok(Box::new(DriveInstruments::new(QUANTITY, spec, on))),
};

const QUANTITY: DriveQuantity = DriveQuantity {
    name: "clamp_pressure",
    unit: "MPa",
    ideal,
    samples: |z| &z.clamp_pressure_mpa,
    samples_mut: |z| &mut z.clamp_pressure_mpa,
};

/// The ideal value, MPa.
pub fn ideal(state: &DriveState, _nominal: &Drive) -> f64 {
    state.clamp_mpa
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensors::tests::train;

    #[test]
    fn it_is_the_pressure_in_the_cylinder() {
        let state = DriveState {
            clamp_mpa: 9.5,
            ..DriveState::default()
        };
        assert_eq!(ideal(&state, &train(1).drives[0]), 9.5);
    }
}
