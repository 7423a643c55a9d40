//! `rls_ekf_robust`: baseline of Liu et al. 2023: mass by least squares without forgetting, slope by an extended Kalman filter with
//! fixed noise. Same regression and same filter equations as `dffrls_aekf_robust`, so that a comparison shows what forgetting and
//! adaptation do, and nothing else. With a load that never changes, no forgetting is the best forgetting.

use crate::api::params::param_groups;
use crate::api::signals::Vehicle;
use crate::filters::forgetting::Forgetting;
use crate::grade::force_balance_ekf::{Adaptation, ForceBalanceEkf, GradeParams};
use crate::mass::force_balance_rls::{ForceBalanceRls, MassParams};
use crate::models::distributed_train::DistributedTrain;
use crate::models::force_balance::ForceBalance;
use crate::pipelines::two_stage::TwoStage;

param_groups! {
    /// Parameters of `rls_ekf_robust`.
    Params { mass: MassParams, slope: GradeParams }
}

/// The pipeline.
pub type RlsEkf = TwoStage<ForceBalanceRls>;

/// From the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> RlsEkf {
    let balance = ForceBalance::new(vehicle);
    let own = &params.mass;
    TwoStage::new(
        vehicle,
        ForceBalanceRls::resampler(own),
        DistributedTrain::new(vehicle, own.standstill_mps),
        ForceBalanceRls::new(vehicle, *own, Forgetting::None),
        ForceBalanceEkf::new(balance, params.slope, Adaptation::None),
        own.standstill_mps,
    )
}
