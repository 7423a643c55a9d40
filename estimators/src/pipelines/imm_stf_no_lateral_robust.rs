//! `imm_stf_no_lateral_robust`: `imm_stf_robust` that takes bends for straights, the baseline of Guo et al. 2024. On a rail the two are the same.

use crate::api::params::param_groups;
use crate::api::signals::Vehicle;
use crate::grade::imm::{
    Acceleration, Choice, ImmParams, ModelParams, SlopeModels, TrackingParams,
};
use crate::mass::differenced_rls::DifferencedParams;

param_groups! {
    /// Parameters of `imm_stf_no_lateral_robust`.
    Params { imm: ImmParams, models: ModelParams, tracking: TrackingParams, mass: DifferencedParams }
}

/// The pipeline.
pub type ImmStfNoLateral = SlopeModels<2>;

/// From the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> ImmStfNoLateral {
    let choice = Choice {
        models: [Acceleration::Kinematic, Acceleration::Dynamic],
        stay: params.imm.stay,
        time_varying: true,
        tracking: Some(params.tracking),
        lateral: false,
    };
    SlopeModels::new(vehicle, params.models, params.mass, choice)
}
