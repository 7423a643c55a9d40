//! Clamp pressure: pressure in the clamp cylinder of a drive unit, MPa.

use crate::plant::DriveState;
use crate::train::Drive;

/// Name in events and errors; `[i]` follows for a single unit.
pub const NAME: &str = "clamp_pressure";

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
