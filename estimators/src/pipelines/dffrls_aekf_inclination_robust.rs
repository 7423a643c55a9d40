//! `dffrls_aekf_inclination_robust`: `dffrls_aukf_robust` with an extended Kalman filter in place of the unscented one ([`CurvatureSlope`]), a
//! baseline of the DFFRLS-AUKF paper, which calls it DFFRLS-AEKF. Not the `dffrls_aekf_robust` of Liu et al. 2023, which goes by traction.

use crate::api::params::param_groups;
use crate::api::signals::Vehicle;
use crate::grade::curvature_rls::{Curvature, CurvatureParams, DynamicForgetting};
use crate::grade::inertial::{CurvatureSlope, InertialEkf, InertialParams};
use crate::pipelines::dffrls_aukf_robust::AdaptiveParams;

param_groups! {
    /// Parameters of `dffrls_aekf_inclination_robust`.
    Params { adaptive: AdaptiveParams, slope: InertialParams, curvature: CurvatureParams, forgetting: DynamicForgetting }
}

/// The pipeline.
pub type DffrlsAekfInclination = CurvatureSlope<InertialEkf, 1>;

/// From the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> DffrlsAekfInclination {
    let policy = params.forgetting.policy();
    let curvature = Curvature::new(vehicle, params.curvature, 0.0, policy);
    let fading = Some(params.adaptive.b);
    CurvatureSlope::extended(vehicle, params.slope, curvature, fading)
}
