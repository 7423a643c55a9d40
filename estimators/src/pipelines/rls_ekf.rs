//! `rls_ekf`: baseline of Liu et al. 2023: mass by least squares without forgetting, slope by an extended Kalman filter with
//! fixed noise. Same regression and same filter equations as `dffrls_aekf`, so that a comparison shows what forgetting and
//! adaptation do, and nothing else. With a load that never changes, no forgetting is the best forgetting.

use crate::api::params::param_groups;
use crate::api::signals::Vehicle;
use crate::filters::forgetting::Forgetting;
use crate::grade::force_balance_ekf::{Adaptation, SlopeFilter, SlopeParams};
use crate::mass::force_balance_rls::{MassParams, MassRegression};
use crate::models::force_balance::ForceBalance;
use crate::pipelines::two_stage::MassThenSlope;

param_groups! {
    /// Parameters of `rls_ekf`.
    Params { mass: MassParams, slope: SlopeParams }
}

/// The pipeline.
pub type RlsEkf = MassThenSlope<MassRegression>;

/// From the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> RlsEkf {
    let balance = ForceBalance::new(vehicle);
    MassThenSlope {
        balance,
        mass: MassRegression::new(vehicle, params.mass, Forgetting::None),
        slope: SlopeFilter::new(balance, params.slope, Adaptation::None),
        standstill_mps: vehicle.standstill_mps(params.mass.standstill_mps),
    }
}
