//! Supervised form of the paper "dynamic inclination recognition of monorail crane based on DFFRLS-AUKF" (Huainan main
//! roadway tests): vertical curvature by least squares that forget by the residual, slope by an unscented Kalman filter
//! on accelerometer and wheel speed that the curvature carries forward ([`CurvatureSlope`]).
//!
//! Sage-Husa adapts the wheel-speed noise alone, in a form that stays positive: it helps where the noise was set
//! wrongly, and costs a little where it was set rightly.

use crate::api::params::params;
use crate::detect::validity::Integrity;
use crate::filters::ukf::SigmaParams;
use crate::fusion::attitude::params::{AttitudeParams, AttitudeSupervision};
use crate::preprocess::conditioning::ConditioningParams;
use crate::supervised::curvature_rls::{Curvature, CurvatureParams, DynamicForgetting};
use crate::supervised::inertial::{CurvatureSlope, InertialParams};
use crate::supervised::pipeline::{CoreParams, Supervised, Supervision};

params! {
    /// Adaptation of the inertial slope filter.
    AdaptiveParams {
        b ["-"] = 0.998, 0.5 => 0.99999, "Fading factor b of the adapted wheel-speed noise, per wheel-speed sample.";
    }
}

variants! {
    /// `dffrls_aukf_robust`: the method.
    dffrls_aukf_robust: DffrlsAukf = Supervised<CurvatureSlope>,
        { adaptive: AdaptiveParams, slope: InertialParams, sigma_points: SigmaParams, curvature: CurvatureParams, forgetting: DynamicForgetting, supervision: Supervision, attitude: AttitudeParams, attitude_supervision: AttitudeSupervision, integrity: Integrity, conditioning: ConditioningParams },
        |vehicle, p| {
            let core = CoreParams {
                attitude: p.attitude,
                attitude_supervision: p.attitude_supervision,
                supervision: p.supervision,
                integrity: p.integrity,
                conditioning: p.conditioning,
            };
            let curvature = Curvature::new(vehicle, p.curvature, p.forgetting.policy());
            let method = CurvatureSlope::new(vehicle, p.slope, curvature, p.sigma_points, Some(p.adaptive.b), &p.integrity, p.attitude.wheel_speed_sd_mps);
            Supervised::new(vehicle, &core, [p.curvature.cutoff_hz, p.curvature.regression_hz, p.curvature.settle_s], method)
        };
}
