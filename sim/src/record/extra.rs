//! Channels that something outside of the simulator adds to a recording.

use super::Channel;
use crate::closed_loop::Simulation;
use crate::plant::Truth;

/// Channels in addition to the channels of the simulator, such as the Cramér-Rao bound of the run.
pub trait ExtraChannels {
    /// The channels. Called once, when the run is about to start.
    fn begin(&mut self, simulation: &Simulation) -> Vec<Channel>;
    /// A step of the plant later.
    fn step(&mut self, truth: &Truth);
    /// Append the values of a row, one a channel; not a number where there is none.
    fn values(&self, row: &mut Vec<f64>);
}
