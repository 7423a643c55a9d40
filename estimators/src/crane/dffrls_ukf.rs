//! `dffrls_ukf`: curvature by least squares with dynamic forgetting, slope by an unscented Kalman filter with fixed noise
//! ([`CurvatureUkf`]). The baseline of `dffrls_aukf`.

use super::{
    curvature::CurvatureParams,
    curvature_ukf::{CurvatureUkf, UkfParams},
    params::param_groups,
};
use crate::signals::Vehicle;

param_groups! {
    /// Parameters of `dffrls_ukf`.
    Params { ukf: UkfParams, curvature: CurvatureParams }
}

/// The pipeline.
pub type DffrlsUkf = CurvatureUkf;

/// From the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> DffrlsUkf {
    CurvatureUkf::new(vehicle, params.ukf, params.curvature, None)
}
