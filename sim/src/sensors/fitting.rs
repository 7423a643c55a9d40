//! The vehicle and the track that an instrument is fitted to.

use crate::train::Train;

/// Vehicle that an instrument is fitted to, track under it, and seed of its errors.
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
    /// Fits to this vehicle, on a rail without joints.
    pub fn new(train: &'a Train, gravity_mps2: f64, seed: u64) -> Self {
        Self {
            train,
            gravity_mps2,
            joints_m: &[],
            seed,
        }
    }
}
