//! `dffrls_aukf`: the paper "dynamic inclination recognition of monorail crane based on DFFRLS-AUKF" (Huainan main roadway tests): curvature (least squares with dynamic forgetting) and an adaptive
//! unscented Kalman filter ([`CurvatureUkf`]); Sage-Husa adapts the wheel-speed noise alone, in a form that stays positive.
//! It helps where the noise was told wrongly, and costs a little where it was told rightly.

use super::{
    curvature::CurvatureParams,
    curvature_ukf::{CurvatureUkf, UkfParams},
    params::{param_groups, params},
};
use crate::signals::Vehicle;

params! {
    /// How `dffrls_aukf` adapts.
    Own {
        b ["-"] = 0.998, 0.5 => 0.99999, "Fading factor b of the adapted wheel-speed noise, per wheel-speed sample.";
    }
}

param_groups! {
    /// Parameters of `dffrls_aukf`.
    Params { own: Own, ukf: UkfParams, curvature: CurvatureParams }
}

/// The pipeline.
pub type DffrlsAukf = CurvatureUkf;

/// From the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> DffrlsAukf {
    CurvatureUkf::new(vehicle, params.ukf, params.curvature, Some(params.own.b))
}
