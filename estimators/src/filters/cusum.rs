//! Notices that the load has been picked up or set down.

use crate::Real;
use crate::api::snapshot::state;

/// Size of one residual, in standard deviations, that is taken as ordinary.
const ORDINARY: Real = 1.5;

/// Two-sided cumulated sum of normalised residuals (Page 1954): residuals that keep to one side mean another load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadChangeDetector {
    threshold: Real,
    up: Real,
    down: Real,
    changes: u32,
}

impl LoadChangeDetector {
    /// Alarm when a sum passes `threshold`; 0 = never.
    pub fn new(threshold: Real) -> Self {
        Self {
            threshold,
            up: 0.0,
            down: 0.0,
            changes: 0,
        }
    }

    /// One residual in units of its standard deviation. Tells whether the load is another one.
    pub fn changed(&mut self, normalised: Real) -> bool {
        self.up = (self.up + normalised - ORDINARY).max(0.0);
        self.down = (self.down - normalised - ORDINARY).max(0.0);
        let changed = self.threshold > 0.0 && self.up.max(self.down) > self.threshold;
        if changed {
            (self.up, self.down) = (0.0, 0.0);
            self.changes = self.changes.saturating_add(1);
        }
        changed
    }

    /// Whether residuals keep to no side: nothing has spoken for another load since the last such time.
    pub fn reset(&self) -> bool {
        self.up == 0.0 && self.down == 0.0
    }

    /// How often it was another one.
    pub fn changes(&self) -> u32 {
        self.changes
    }
}

state!(LoadChangeDetector { up, down, changes; threshold });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    #[test]
    fn noise_is_no_change_and_a_shift_is() {
        let mut watch = LoadChangeDetector::new(20.0);
        let mut random = Random::new(71);
        assert!((0..100_000).all(|_| !watch.changed(random.normal())));
        for shift in [4.0, -4.0] {
            let steps = (0..20).position(|_| watch.changed(shift + random.normal()));
            assert!(steps.is_some());
        }
        assert_eq!(watch.changes(), 2);
        let mut off = LoadChangeDetector::new(0.0);
        assert!((0..100).all(|_| !off.changed(100.0)));
    }
}
