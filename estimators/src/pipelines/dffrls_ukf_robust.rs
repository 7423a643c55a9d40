//! `dffrls_ukf_robust`: curvature by least squares with dynamic forgetting, slope by an unscented Kalman filter with fixed noise
//! ([`CurvatureSlope`]). The baseline of `dffrls_aukf_robust`.

use crate::api::params::param_groups;
use crate::api::signals::Vehicle;
use crate::grade::curvature_rls::{Curvature, CurvatureParams, DynamicForgetting};
use crate::grade::inertial::{CurvatureSlope, InertialParams, InertialUkf, SigmaParams};

param_groups! {
    /// Parameters of `dffrls_ukf_robust`.
    Params { slope: InertialParams, sigma_points: SigmaParams, curvature: CurvatureParams, forgetting: DynamicForgetting }
}

/// The pipeline.
pub type DffrlsUkf = CurvatureSlope<InertialUkf, 1>;

/// From the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> DffrlsUkf {
    let policy = params.forgetting.policy();
    let curvature = Curvature::new(vehicle, params.curvature, 0.0, policy);
    let fading = None;
    CurvatureSlope::unscented(
        vehicle,
        params.slope,
        curvature,
        params.sigma_points,
        fading,
    )
}
