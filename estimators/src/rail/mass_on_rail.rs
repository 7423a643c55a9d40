//! Masses of a train on the read rail, and the additional uncertainty from unread rail.

use crate::Real;
use crate::rail::train_means::TrainMeans;
use crate::tuning::RAIL;

/// Masses for the mean in the effective grade, and the grade of the rail behind the read rail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassOnRail {
    /// Total mass, kg.
    pub mass_kg: Real,
    /// Load, kg.
    pub load_kg: Real,
    /// Standard deviation of the load, kg.
    pub load_sd_kg: Real,
    /// Grade `RAIL.eta_m` behind the read rail minus the grade at its end, rad.
    pub eta_rad: Real,
    /// Its variance, rad².
    pub eta_variance: Real,
}

impl MassOnRail {
    /// Mean distance of the masses behind the read rail, as a share of `RAIL.eta_m`.
    pub fn behind(&self, means: &TrainMeans) -> Real {
        (means.behind_tare_kgm + self.load_kg * means.behind_load_m) / RAIL.eta_m / self.mass_kg
    }

    /// Variance of the mean grade due to unread rail.
    pub fn unread_variance(&self, means: &TrainMeans) -> Real {
        let ahead = means.ahead_kgm / self.mass_kg * means.ahead_rad_per_m;
        let behind = self.behind(means);
        ahead * ahead + behind * behind * self.eta_variance
    }
}
