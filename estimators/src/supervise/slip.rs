//! Slip detector: whether wheel speed follows the force balance.

use crate::Real;

/// Adapted over nominal standard deviation of wheel speed from which the wheels are taken to slip.
const MAX_SD_RATIO: Real = 3.0;

/// Slip detector: wheels slip while the adapted standard deviation of wheel speed is three times the nominal one or more.
///
/// It finds what the [`WheelSpeedVote`](crate::preprocess::wheel_speed_vote::WheelSpeedVote) cannot: all wheels slipping alike. It needs a
/// filter that adapts its measurement noise; with fixed noise it finds nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlipDetector {
    on: bool,
    max_sd_mps: Real,
}

impl SlipDetector {
    /// For a nominal standard deviation of wheel speed, m/s. If not `on`, wheels never slip.
    pub fn new(on: bool, nominal_sd_mps: Real) -> Self {
        Self {
            on,
            max_sd_mps: MAX_SD_RATIO * nominal_sd_mps,
        }
    }

    /// Whether wheel speed, of an adapted standard deviation in m/s, follows the force balance about as closely as its noise says.
    pub fn wheel_speed_consistent(&self, adapted_sd_mps: Real) -> bool {
        !self.on || adapted_sd_mps < self.max_sd_mps
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_times_the_nominal_noise_is_slip() {
        let detector = SlipDetector::new(true, 0.005);
        assert!(detector.wheel_speed_consistent(0.0149));
        assert!(!detector.wheel_speed_consistent(0.0151));
        assert!(SlipDetector::new(false, 0.005).wheel_speed_consistent(1.0));
    }
}
