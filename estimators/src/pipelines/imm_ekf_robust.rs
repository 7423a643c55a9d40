//! `imm_ekf_robust`: `imm_stf_robust` with plain Kalman filters in place of strong tracking. Its models are linear once the cosine of the combined
//! estimate is put in, so that the extended filter is the plain one.

use crate::api::params::param_groups;
use crate::api::signals::Vehicle;
use crate::grade::imm::{Acceleration, Choice, ImmParams, ModelParams, SlopeModels};
use crate::mass::differenced_rls::DifferencedParams;

param_groups! {
    /// Parameters of `imm_ekf_robust`.
    Params { imm: ImmParams, models: ModelParams, mass: DifferencedParams }
}

/// The pipeline.
pub type ImmEkf = SlopeModels<2>;

/// From the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> ImmEkf {
    let choice = Choice {
        models: [Acceleration::Kinematic, Acceleration::Dynamic],
        stay: params.imm.stay,
        time_varying: true,
        tracking: None,
        lateral: true,
    };
    SlopeModels::new(vehicle, params.models, params.mass, choice)
}
