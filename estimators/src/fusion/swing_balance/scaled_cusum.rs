//! CUSUM of residuals that are scaled by their own slow spread, with a pause after an alarm.

use crate::Real;
use crate::api::real::sqrt;
use crate::api::snapshot::state;
use crate::detect::cusum::Cusum;
use crate::tuning;

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
            sum: Cusum::new(tuning::CUSUM.allowance, tuning::CUSUM.threshold),
            square: 1.0,
            pause_s: 0.0,
        }
    }
}

impl ScaledCusum {
    /// Starts anew after an alarm, with a pause.
    pub fn paused() -> Self {
        Self {
            pause_s: tuning::CUSUM.pause_s,
            ..Self::default()
        }
    }

    /// Takes a normalised residual of a block of `length_s`; returns whether residuals keep to one side.
    pub fn alarm(&mut self, residual: Real, length_s: Real) -> bool {
        let scaled = residual / sqrt(self.square.max(1.0));
        self.square += length_s / tuning::CUSUM.scale_s
            * ((residual * residual)
                .min(tuning::STATISTICS.noise_sd * tuning::STATISTICS.noise_sd)
                - self.square);
        self.pause_s = (self.pause_s - length_s).max(0.0);
        let alarm = self
            .sum
            .alarm(scaled.clamp(-tuning::CUSUM.max_residual, tuning::CUSUM.max_residual));
        alarm && self.pause_s <= 0.0
    }

    /// Returns true if residuals keep to no side.
    pub fn at_rest(&self) -> bool {
        self.sum.at_rest()
    }

    /// Takes the sums back to 0.
    pub fn clear(&mut self) {
        self.sum = Cusum::new(tuning::CUSUM.allowance, tuning::CUSUM.threshold);
    }
}

state!(ScaledCusum { sum, square, pause_s; });

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    const BLOCK_S: Real = 0.5;

    /// Number of the first of these residuals at which there is an alarm.
    fn first_alarm(
        mut detector: ScaledCusum,
        residuals: impl IntoIterator<Item = Real>,
    ) -> Option<usize> {
        residuals
            .into_iter()
            .position(|residual| detector.alarm(residual, BLOCK_S))
    }

    fn mirrored(residuals: &[Real]) -> Vec<Real> {
        residuals.iter().map(|r| -r).collect()
    }

    /// Residuals of 1.2 standard deviations are allowed. Those of 3.4 are beyond it until their spread has been learnt,
    /// and add up to 20 in some ten seconds. However large they are, one of them counts for no more than 5, which is
    /// 3.8 beyond: six make an alarm.
    #[test]
    fn residuals_that_keep_to_one_side_are_an_alarm() {
        let new = ScaledCusum::default();
        assert_eq!(first_alarm(new, [1.2; 1_000]), None);
        let late = first_alarm(new, [3.4; 100]).unwrap();
        let soon = first_alarm(new, [50.0; 100]).unwrap();
        assert!(soon == 5 && (10..40).contains(&late), "{soon} {late}");
        for residuals in [[3.4; 100], [50.0; 100]] {
            let other = first_alarm(new, mirrored(&residuals));
            assert_eq!(other, first_alarm(new, residuals));
        }
    }

    /// However large they are, a few residuals of one side, or many of both, are no other load.
    #[test]
    fn outliers_and_residuals_of_both_sides_are_none() {
        let new = ScaledCusum::default();
        assert_eq!(first_alarm(new, [1e6; 5]), None);
        let both = (0..1_000).map(|k| if k % 2 == 0 { 8.0 } else { -8.0 });
        assert_eq!(first_alarm(new, both), None);
    }

    /// A filter whose residuals are three times as large as it says has a spread of 3 after a minute: residuals of
    /// 3.4 to one side are then no more than 1.13 is. Its memory is 20 s: after 20 s the square is 1 + 8 (1 − 1/e).
    #[test]
    fn the_spread_of_the_residuals_is_learnt() {
        let mut detector = ScaledCusum::default();
        let both = |k: usize| if k.is_multiple_of(2) { 3.0 } else { -3.0 };
        let learn = |detector: &mut ScaledCusum, seconds: Real| {
            (0..(seconds / BLOCK_S) as usize).for_each(|k| {
                detector.alarm(both(k), BLOCK_S);
            });
        };
        learn(&mut detector, tuning::CUSUM.scale_s);
        let expected = 1.0 + 8.0 * (1.0 - (-1.0 as Real).exp());
        assert!((detector.square / expected - 1.0).abs() < 0.02);
        learn(&mut detector, 100.0);
        assert!(first_alarm(ScaledCusum::default(), [3.4; 100]).is_some());
        assert_eq!(first_alarm(detector, [3.4; 100]), None);
        // no residual teaches a square beyond 9
        (0..1_000).for_each(|k| {
            detector.alarm(1e3 * both(k), BLOCK_S);
        });
        assert!(detector.square < 9.0 + 1e-6);
    }

    /// After an alarm there is none for 15 s, and then one again if they still keep to one side.
    #[test]
    fn after_an_alarm_there_is_a_pause() {
        let again = first_alarm(ScaledCusum::paused(), [50.0; 100]).unwrap();
        let paused = (tuning::CUSUM.pause_s / BLOCK_S) as usize;
        assert!((paused - 1..paused + 10).contains(&again), "{again}");
    }

    #[test]
    fn cleared_it_has_no_side() {
        let mut detector = ScaledCusum::default();
        assert!(detector.at_rest());
        detector.alarm(3.0, BLOCK_S);
        assert!(!detector.at_rest());
        detector.clear();
        assert!(detector.at_rest());
        assert_eq!(first_alarm(detector, [5.0; 5]), None);
    }
}
