//! Tolerances: how far what an estimator is told of a vehicle may be from the truth.

use crate::Real;

/// Standard deviations of the nominal values of a vehicle. Shares are of the true value.
///
/// A simulated world draws what it tells from [`TOLERANCES`], and the priors of `rail_fusion` are the same numbers by
/// default: a standard deviation that is too wide shows as much as one that is too narrow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerances {
    /// Rotation of the IMU against its unit about each axis, degrees.
    pub mount_deg: Real,
    /// Mass of the empty train, share.
    pub tare: Real,
    /// Radius of the wheels, share: wear.
    pub wheel_radius: Real,
    /// Efficiency of the gears, share: temperature, wear, oil.
    pub efficiency: Real,
    /// Running-resistance coefficient, share.
    pub running_resistance: Real,
    /// Length of the load's chains, share.
    pub chain: Real,
}

/// Usual tolerances of a train in a mine: an IMU aligned with a spirit level, a data sheet, gears and wheels in use.
pub const TOLERANCES: Tolerances = Tolerances {
    mount_deg: 0.2,
    tare: 0.02,
    wheel_radius: 0.01,
    efficiency: 0.035,
    running_resistance: 0.2,
    chain: 0.1,
};
