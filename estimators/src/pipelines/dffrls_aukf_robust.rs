//! `dffrls_aukf_robust`: the paper "dynamic inclination recognition of monorail crane based on DFFRLS-AUKF" (Huainan main roadway tests):
//! curvature by least squares with dynamic forgetting, slope by an adaptive unscented Kalman filter ([`CurvatureSlope`]); Sage-Husa
//! adapts the wheel-speed noise alone, in a form that stays positive. It helps where the noise was told wrongly, and costs a little
//! where it was told rightly.

use crate::api::params::{param_groups, params};
use crate::api::signals::Vehicle;
use crate::grade::curvature_rls::{Curvature, CurvatureParams, DynamicForgetting};
use crate::grade::inertial::{CurvatureSlope, InertialParams, InertialUkf, SigmaParams};

params! {
    /// How the inertial slope filter adapts.
    AdaptiveParams {
        b ["-"] = 0.998, 0.5 => 0.99999, "Fading factor b of the adapted wheel-speed noise, per wheel-speed sample.";
    }
}

param_groups! {
    /// Parameters of `dffrls_aukf_robust`.
    Params { adaptive: AdaptiveParams, slope: InertialParams, sigma_points: SigmaParams, curvature: CurvatureParams, forgetting: DynamicForgetting }
}

/// The pipeline.
pub type DffrlsAukf = CurvatureSlope<InertialUkf, 1>;

/// From the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> DffrlsAukf {
    let policy = params.forgetting.policy();
    let curvature = Curvature::new(vehicle, params.curvature, 0.0, policy);
    let fading = Some(params.adaptive.b);
    CurvatureSlope::unscented(
        vehicle,
        params.slope,
        curvature,
        params.sigma_points,
        fading,
    )
}
