//! `kinematic_stf_robust`: the kinematic model of Guo et al. 2024 alone, with strong tracking.

use crate::api::params::param_groups;
use crate::api::signals::Vehicle;
use crate::grade::imm::{Acceleration, Choice, ModelParams, SlopeModels, TrackingParams};
use crate::mass::differenced_rls::DifferencedParams;

param_groups! {
    /// Parameters of `kinematic_stf_robust`.
    Params { models: ModelParams, tracking: TrackingParams, mass: DifferencedParams }
}

/// The pipeline.
pub type KinematicStf = SlopeModels<1>;

/// From the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> KinematicStf {
    let choice = Choice {
        models: [Acceleration::Kinematic],
        stay: 1.0,
        time_varying: false,
        tracking: Some(params.tracking),
        lateral: true,
    };
    SlopeModels::new(vehicle, params.models, params.mass, choice)
}
