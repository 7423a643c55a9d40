//! `imm_stf_robust`: Guo, Wang, Zhao & Dai 2024: mass from differences ([`DifferencedParams`]), slope by a kinematic and a dynamic model
//! ([`SlopeModels`]) with strong tracking each, interacting with time-varying transitions, corrected for bends on a road.

use crate::api::params::param_groups;
use crate::api::signals::Vehicle;
use crate::grade::imm::{
    Acceleration, Choice, ImmParams, ModelParams, SlopeModels, TrackingParams,
};
use crate::mass::differenced_rls::DifferencedParams;

param_groups! {
    /// Parameters of `imm_stf_robust`.
    Params { imm: ImmParams, models: ModelParams, tracking: TrackingParams, mass: DifferencedParams }
}

/// The pipeline.
pub type ImmStf = SlopeModels<2>;

/// From the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> ImmStf {
    let choice = Choice {
        models: [Acceleration::Kinematic, Acceleration::Dynamic],
        stay: params.imm.stay,
        time_varying: true,
        tracking: Some(params.tracking),
        lateral: true,
    };
    SlopeModels::new(vehicle, params.models, params.mass, choice)
}
