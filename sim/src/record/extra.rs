//! Channels that code outside the simulator adds to a recording.

use super::Channel;
use crate::closed_loop::Simulation;
use crate::plant::Truth;

/// Channels in addition to the channels of the simulator, such as the Cramér-Rao bound of the run.
pub trait ExtraChannels {
    /// The channels. Called once, when the run is about to start.
    fn begin(&mut self, simulation: &Simulation) -> Vec<Channel>;
    /// Called after each step of the plant.
    fn step(&mut self, truth: &Truth);
    /// Appends the values of a row, one for each channel; NaN without a value.
    fn values(&self, row: &mut Vec<f64>);
}
