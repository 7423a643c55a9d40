//! `rls_mff_aukf_robust`: `dffrls_aukf_robust` with multiple forgetting (Vahidi, Stefanopoulou & Peng 2005) of curvature and offset, a baseline of
//! the DFFRLS-AUKF paper. The paper does not say what its second parameter is; with the curvature alone, multiple forgetting is the
//! constant one.

use crate::api::params::{param_groups, params};
use crate::api::signals::Vehicle;
use crate::filters::forgetting::Forgetting;
use crate::grade::curvature_rls::{Curvature, CurvatureParams};
use crate::grade::inertial::{CurvatureSlope, InertialParams, InertialUkf, SigmaParams};
use crate::pipelines::dffrls_aukf_robust::AdaptiveParams;

params! {
    /// Multiple forgetting of the curvature and an offset.
    Own {
        lambda_curvature ["-"] = 0.9, 0.5 => 1.0, "Forgetting factor of the curvature, per regression sample.";
        lambda_offset ["-"] = 0.995, 0.5 => 1.0, "Forgetting factor of the offset, per regression sample.";
        offset_sd_mps3 ["m/s³"] = 0.01, 1e-6 => 10.0, "Standard deviation of the offset of d(f − v̇)/dt.";
    }
}

param_groups! {
    /// Parameters of `rls_mff_aukf_robust`.
    Params { own: Own, adaptive: AdaptiveParams, slope: InertialParams, sigma_points: SigmaParams, curvature: CurvatureParams }
}

/// The pipeline.
pub type RlsMffAukf = CurvatureSlope<InertialUkf, 2>;

/// From the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> RlsMffAukf {
    let policy = Forgetting::Multiple([params.own.lambda_curvature, params.own.lambda_offset]);
    let curvature = Curvature::new(vehicle, params.curvature, params.own.offset_sd_mps3, policy);
    let fading = Some(params.adaptive.b);
    CurvatureSlope::unscented(
        vehicle,
        params.slope,
        curvature,
        params.sigma_points,
        fading,
    )
}
