//! `dynamic_stf_robust`: the dynamic model of Guo et al. 2024 alone, with strong tracking. Where there is no force balance (standing, braking,
//! torque unknown) it goes on as the kinematic one.

use crate::api::params::param_groups;
use crate::api::signals::Vehicle;
use crate::grade::imm::{Acceleration, Choice, ModelParams, SlopeModels, TrackingParams};
use crate::mass::differenced_rls::DifferencedParams;

param_groups! {
    /// Parameters of `dynamic_stf_robust`.
    Params { models: ModelParams, tracking: TrackingParams, mass: DifferencedParams }
}

/// The pipeline.
pub type DynamicStf = SlopeModels<1>;

/// From the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> DynamicStf {
    let choice = Choice {
        models: [Acceleration::Dynamic],
        stay: 1.0,
        time_varying: false,
        tracking: Some(params.tracking),
        lateral: true,
    };
    SlopeModels::new(vehicle, params.models, params.mass, choice)
}
