//! What an instrument is fitted to.

use crate::train::Train;

/// What an instrument is fitted to, the track it rides on, and the seed of its errors.
pub struct Fitting<'a> {
    /// The vehicle.
    pub train: &'a Train,
    /// Gravity, m/s².
    pub gravity_mps2: f64,
    /// Chainages of the rail's joints, ascending, m.
    pub joints_m: &'a [f64],
    /// Seed of the run.
    pub seed: u64,
}

impl<'a> Fitting<'a> {
    /// To this vehicle, on a rail without joints.
    pub fn new(train: &'a Train, gravity_mps2: f64, seed: u64) -> Self {
        Self {
            train,
            gravity_mps2,
            joints_m: &[],
            seed,
        }
    }
}
