//! CUSUM of residuals that are scaled by their own slow spread, with a pause after an alarm.

use crate::Real;
use crate::api::real::sqrt;
use crate::api::snapshot::state;
use crate::detect::cusum::Cusum;

/// Allowance and threshold of the sums.
const ALLOWANCE: Real = 1.2;
const THRESHOLD: Real = 20.0;
/// Memory of the square of the residuals by which they are scaled, s.
const SCALE_S: Real = 20.0;
/// Largest scaled residual and largest square that are taken.
const MAX_RESIDUAL: Real = 5.0;
const MAX_SQUARE: Real = 9.0;
/// Pause after an alarm, s.
const PAUSE_S: Real = 15.0;

/// The detector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScaledCusum {
    sum: Cusum,
    square: Real,
    pause_s: Real,
}

/// Starts with residuals of the variance 1.
impl Default for ScaledCusum {
    fn default() -> Self {
        Self {
            sum: Cusum::new(ALLOWANCE, THRESHOLD),
            square: 1.0,
            pause_s: 0.0,
        }
    }
}

impl ScaledCusum {
    /// Starts anew after an alarm, with a pause.
    pub fn paused() -> Self {
        Self {
            pause_s: PAUSE_S,
            ..Self::default()
        }
    }

    /// Takes a normalised residual of a block of `length_s`; returns whether residuals keep to one side.
    pub fn alarm(&mut self, residual: Real, length_s: Real) -> bool {
        let scaled = residual / sqrt(self.square.max(1.0));
        self.square += length_s / SCALE_S * ((residual * residual).min(MAX_SQUARE) - self.square);
        self.pause_s = (self.pause_s - length_s).max(0.0);
        let alarm = self.sum.alarm(scaled.clamp(-MAX_RESIDUAL, MAX_RESIDUAL));
        alarm && self.pause_s <= 0.0
    }

    /// Returns true if residuals keep to no side.
    pub fn at_rest(&self) -> bool {
        self.sum.at_rest()
    }

    /// Takes the sums back to 0.
    pub fn clear(&mut self) {
        self.sum = Cusum::new(ALLOWANCE, THRESHOLD);
    }
}

state!(ScaledCusum { sum, square, pause_s; });
