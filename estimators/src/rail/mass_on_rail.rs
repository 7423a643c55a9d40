//! Masses of a train as they weigh on the rail it has read, and what the rail that it has not read adds.

use crate::Real;
use crate::rail::train_means::TrainMeans;
use crate::tuning;

/// Masses that the effective grade is a mean over, and the grade of the rail behind the one read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassOnRail {
    /// Total mass, kg.
    pub mass_kg: Real,
    /// Load in it, kg.
    pub load_kg: Real,
    /// Standard deviation of the load, kg.
    pub load_sd_kg: Real,
    /// Grade `RAIL.eta_m` behind the rail read beyond that of its end, rad.
    pub eta_rad: Real,
    /// Its variance, rad².
    pub eta_variance: Real,
}

impl MassOnRail {
    /// Mean distance of the masses behind the rail read, as a share of `RAIL.eta_m`.
    pub fn behind(&self, means: &TrainMeans) -> Real {
        (means.behind_tare_kgm + self.load_kg * means.behind_load_m)
            / tuning::RAIL.eta_m
            / self.mass_kg
    }

    /// Variance of the mean grade from rail behind what was read.
    pub fn behind_variance(&self, means: &TrainMeans) -> Real {
        let behind = self.behind(means);
        behind * behind * self.eta_variance
    }

    /// Variance of the mean grade from rail that was not read.
    pub fn unread_variance(&self, means: &TrainMeans) -> Real {
        let ahead = means.ahead_kgm / self.mass_kg * means.ahead_rad_per_m;
        ahead * ahead + self.behind_variance(means)
    }
}
