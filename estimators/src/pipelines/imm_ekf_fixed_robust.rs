//! `imm_ekf_fixed_robust`: plain Kalman filters that interact with fixed transition probabilities: the method of Blom & Bar-Shalom 1988.

use crate::api::params::param_groups;
use crate::api::signals::Vehicle;
use crate::grade::imm::{Acceleration, Choice, ImmParams, ModelParams, SlopeModels};
use crate::mass::differenced_rls::DifferencedParams;

param_groups! {
    /// Parameters of `imm_ekf_fixed_robust`.
    Params { imm: ImmParams, models: ModelParams, mass: DifferencedParams }
}

/// The pipeline.
pub type ImmEkfFixed = SlopeModels<2>;

/// From the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> ImmEkfFixed {
    let choice = Choice {
        models: [Acceleration::Kinematic, Acceleration::Dynamic],
        stay: params.imm.stay,
        time_varying: false,
        tracking: None,
        lateral: true,
    };
    SlopeModels::new(vehicle, params.models, params.mass, choice)
}
