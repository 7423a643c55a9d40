//! `ffrls_aukf_robust`: `dffrls_aukf_robust` with constant forgetting of the curvature, a baseline of the DFFRLS-AUKF paper.

use crate::api::params::{param_groups, params};
use crate::api::signals::Vehicle;
use crate::filters::forgetting::Forgetting;
use crate::grade::curvature_rls::{Curvature, CurvatureParams};
use crate::grade::inertial::{CurvatureSlope, InertialParams, InertialUkf, SigmaParams};
use crate::pipelines::dffrls_aukf_robust::AdaptiveParams;

params! {
    /// Constant forgetting of the curvature.
    Own {
        lambda ["-"] = 0.9, 0.5 => 1.0, "Constant forgetting factor, per regression sample.";
    }
}

param_groups! {
    /// Parameters of `ffrls_aukf_robust`.
    Params { own: Own, adaptive: AdaptiveParams, slope: InertialParams, sigma_points: SigmaParams, curvature: CurvatureParams }
}

/// The pipeline.
pub type FfrlsAukf = CurvatureSlope<InertialUkf, 1>;

/// From the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> FfrlsAukf {
    let policy = Forgetting::Constant(params.own.lambda);
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
