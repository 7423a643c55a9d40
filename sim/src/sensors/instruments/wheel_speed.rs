//! Wheel speed: mean rate of the two friction wheels of a drive unit × their nominal radius, m/s.
//!
//! Slip is in it, as in a real encoder. A worn wheel is an error of scale (`scale_error`), an encoder's pulses are
//! quantisation.

use super::drive_instruments::{DriveInstruments, DriveQuantity};
use crate::plant::DriveState;
use crate::sensors::InstrumentKind;
use crate::train::Drive;
use monorig_estimators::api::signals::Measurand;

/// The wheel speed of every drive unit, as a data sheet names it.
pub const KIND: InstrumentKind = InstrumentKind {
    name: QUANTITY.name,
    unsuited: |_| None,
    build: |spec, on| Ok(Box::new(DriveInstruments::new(QUANTITY, spec, on))),
};

const QUANTITY: DriveQuantity = DriveQuantity {
    name: "wheel_speed",
    measurand: Measurand::WheelSpeed,
    ideal,
};

/// The ideal value, m/s.
pub fn ideal(state: &DriveState, nominal: &Drive) -> f64 {
    let [left, right] = state.wheel_rate_radps;
    0.5 * (left + right) * nominal.wheel_radius_m
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensors::behaviour::train;

    /// In a curve one wheel turns faster than the other; their mean stands for the middle of the unit.
    #[test]
    fn it_is_the_mean_rate_times_the_nominal_radius() {
        let state = DriveState {
            wheel_rate_radps: [9.0, 11.0],
            ..DriveState::default()
        };
        assert!((ideal(&state, &train(1).drives[0]) - 1.7).abs() < 1e-15);
    }
}
