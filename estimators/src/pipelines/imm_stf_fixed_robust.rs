//! `imm_stf_fixed_robust`: `imm_stf_robust` with fixed transition probabilities (Blom & Bar-Shalom 1988).

use crate::api::params::param_groups;
use crate::api::signals::Vehicle;
use crate::grade::imm::{
    Acceleration, Choice, ImmParams, ModelParams, SlopeModels, TrackingParams,
};
use crate::mass::differenced_rls::DifferencedParams;

param_groups! {
    /// Parameters of `imm_stf_fixed_robust`.
    Params { imm: ImmParams, models: ModelParams, tracking: TrackingParams, mass: DifferencedParams }
}

/// The pipeline.
pub type ImmStfFixed = SlopeModels<2>;

/// From the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> ImmStfFixed {
    let choice = Choice {
        models: [Acceleration::Kinematic, Acceleration::Dynamic],
        stay: params.imm.stay,
        time_varying: false,
        tracking: Some(params.tracking),
        lateral: true,
    };
    SlopeModels::new(vehicle, params.models, params.mass, choice)
}
