//! Load-change detector: a load has been picked up or set down.

use crate::Real;
use crate::api::snapshot::state;
use crate::detect::cusum::Cusum;
use crate::tuning::LOAD_CHANGE;

/// Load-change detector: two-sided CUSUM of the mass regression's normalised residuals. Residuals that keep to one side
/// mean another load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadChangeDetector {
    on: bool,
    sum: Cusum,
    changes: u32,
}

impl LoadChangeDetector {
    /// Alarm when a sum passes `threshold`; never if not `on`.
    pub fn new(on: bool, threshold: Real) -> Self {
        Self {
            on,
            sum: Cusum::new(LOAD_CHANGE.ordinary_sd, threshold),
            changes: 0,
        }
    }

    /// Takes a residual in units of its standard deviation and returns true if the load has changed.
    pub fn changed(&mut self, normalised: Real) -> bool {
        let changed = self.sum.alarm(normalised) && self.on;
        self.changes = self.changes.saturating_add(u32::from(changed));
        changed
    }

    /// Returns true if residuals have no preferred sign: nothing has hinted at another load since the last such time.
    pub fn at_rest(&self) -> bool {
        self.sum.at_rest()
    }

    /// Number of load changes found.
    pub fn changes(&self) -> u32 {
        self.changes
    }
}

state!(LoadChangeDetector { sum, changes; on });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    #[test]
    fn noise_is_no_change_and_a_shift_is() {
        let mut detector = LoadChangeDetector::new(true, 20.0);
        let mut random = Random::new(71);
        assert!((0..100_000).all(|_| !detector.changed(random.normal())));
        for shift in [4.0, -4.0] {
            let steps = (0..20).position(|_| detector.changed(shift + random.normal()));
            assert!(steps.is_some());
        }
        assert_eq!(detector.changes(), 2);
        let mut off = LoadChangeDetector::new(false, 20.0);
        assert!((0..100).all(|_| !off.changed(100.0)));
        assert_eq!(off.changes(), 0);
    }

    #[test]
    fn a_residual_to_one_side_is_a_hint_until_the_sum_is_used_up() {
        let mut detector = LoadChangeDetector::new(true, 20.0);
        assert!(detector.at_rest());
        detector.changed(3.0);
        assert!(!detector.at_rest());
        detector.changed(0.0);
        assert!(detector.at_rest());
    }
}
