//! Cumulated sum (CUSUM): detects that the mean of a signal has shifted.

use crate::Real;
use crate::api::snapshot::state;

/// Two-sided cumulated sum of a normalised signal (Page 1954).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cusum {
    allowance: Real,
    threshold: Real,
    up: Real,
    down: Real,
}

impl Cusum {
    /// Makes sums of the excess over `allowance` to either side, with an alarm when a sum passes `threshold`.
    pub fn new(allowance: Real, threshold: Real) -> Self {
        Self {
            allowance,
            threshold,
            up: 0.0,
            down: 0.0,
        }
    }

    /// Takes a value and returns true at an alarm, after which both sums start again.
    pub fn alarm(&mut self, value: Real) -> bool {
        self.up = (self.up + value - self.allowance).max(0.0);
        self.down = (self.down - value - self.allowance).max(0.0);
        let alarm = self.up.max(self.down) > self.threshold;
        if alarm {
            (self.up, self.down) = (0.0, 0.0);
        }
        alarm
    }

    /// Returns true if both sums are 0: the signal keeps to no side.
    pub fn at_rest(&self) -> bool {
        self.up == 0.0 && self.down == 0.0
    }
}

state!(Cusum { up, down; allowance, threshold });

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_alarm_comes_when_the_excess_over_the_allowance_adds_up() {
        for sign in [1.0, -1.0] {
            let mut sum = Cusum::new(1.5, 10.0);
            assert!(sum.at_rest() && !sum.alarm(sign * 1.5) && sum.at_rest());
            // 2 above the allowance: passes 10 with the sixth.
            let alarms: std::vec::Vec<bool> = (0..7).map(|_| sum.alarm(sign * 3.5)).collect();
            assert_eq!(alarms, [false, false, false, false, false, true, false]);
        }
    }
}
