//! Courses drawn at random: track, load, drive, instruments and parameters of the estimators, as scenario files. An
//! estimator is tried on courses that nobody tuned it on.
//!
//! Every kind of value is drawn from a stream of its own, made from the seed of the course: another range for one
//! leaves the others as they were.

mod course;
mod drive;
mod instruments;
mod ranges;
mod track;

pub use course::{Course, course};
pub(crate) use instruments::four_digits;
pub use ranges::RangesFile;
pub(crate) use ranges::{DriveRanges, TrackRanges};
pub(crate) use track::round;

use monorig_sim::config::checked::Positive;
use monorig_sim::sensors::stream::Stream;

/// Random numbers for one kind of value.
pub(crate) struct Draws(Stream);

impl Draws {
    pub(crate) fn new(seed: u64, what: &str) -> Self {
        Self(Stream::new(seed, &format!("draw/{what}")))
    }

    /// Draws uniformly between two numbers.
    pub(crate) fn within<T: Into<f64> + Copy>(&mut self, [low, high]: [T; 2]) -> f64 {
        let (low, high) = (low.into(), high.into());
        low + (high - low) * self.0.uniform()
    }

    /// Draws between two numbers, uniformly in the logarithm.
    fn log_within(&mut self, [low, high]: [Positive; 2]) -> f64 {
        let ends = [low, high].map(|x| libm::log(x.get()));
        libm::exp(self.within(ends))
    }

    pub(crate) fn chance(&mut self, share: f64) -> bool {
        self.0.uniform() < share
    }

    /// Draws a place in a list, with probabilities in proportion to the weights.
    pub(crate) fn place(&mut self, weights: &[f64]) -> usize {
        let mut left = self.0.uniform() * weights.iter().sum::<f64>();
        for (i, weight) in weights.iter().enumerate() {
            left -= weight;
            if left < 0.0 {
                return i;
            }
        }
        weights.len().saturating_sub(1)
    }
}
