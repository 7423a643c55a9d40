//! Slip detector: whether wheel speed follows the force balance.

use crate::Real;
use crate::tuning::STATISTICS;

/// Slip detector: wheels slip while the adapted standard deviation of wheel speed is three times the nominal one or
/// more.
///
/// It finds what the [`WheelSpeedVote`](crate::preprocess::wheel_speed_vote::WheelSpeedVote) cannot: all wheels
/// slipping alike. It needs a filter that adapts its measurement noise; with fixed noise it finds nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlipDetector {
    on: bool,
}

impl SlipDetector {
    /// If not `on`, wheels never slip.
    pub fn new(on: bool) -> Self {
        Self { on }
    }

    /// Returns true if wheel speed follows the force balance about as closely as its noise allows, by the ratio of
    /// adapted to un-adapted standard deviation.
    pub fn wheel_speed_consistent(&self, adapted_ratio: Real) -> bool {
        !self.on || adapted_ratio < STATISTICS.noise_sd
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_times_the_nominal_noise_is_slip() {
        let detector = SlipDetector::new(true);
        assert!(detector.wheel_speed_consistent(2.99));
        assert!(!detector.wheel_speed_consistent(3.01));
        assert!(SlipDetector::new(false).wheel_speed_consistent(100.0));
    }
}
