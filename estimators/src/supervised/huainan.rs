//! Robust forms of the paper "dynamic inclination recognition of monorail crane based on DFFRLS-AUKF" (Huainan main roadway tests): vertical
//! curvature by least squares, slope by a Kalman filter on accelerometer and wheel speed that the curvature carries forward
//! ([`CurvatureSlope`]).
//!
//! | name | curvature forgets | Kalman filter | wheel-speed noise |
//! |---|---|---|---|
//! | `dffrls_aukf_robust`, the method | by the residual | unscented | adapted |
//! | `dffrls_ukf_robust` | by the residual | unscented | fixed |
//! | `dffrls_aekf_inclination_robust` | by the residual | extended | adapted |
//! | `ffrls_aukf_robust` | constantly | unscented | adapted |
//! | `rls_mff_aukf_robust` | curvature and offset each by its own factor (Vahidi, Stefanopoulou & Peng 2005) | unscented | adapted |
//!
//! Sage-Husa adapts the wheel-speed noise alone, in a form that stays positive: it helps where the noise was set wrongly, and costs a little
//! where it was set rightly. The paper calls its extended baseline DFFRLS-AEKF; it is not the `dffrls_aekf` of Liu et al. 2023, which goes
//! by traction. It does not say what the second parameter of its multiple forgetting is; with the curvature alone, multiple forgetting is
//! the constant one.

use crate::api::params::params;
use crate::filters::forgetting::Forgetting;
use crate::supervised::curvature_rls::{Curvature, CurvatureParams, DynamicForgetting};
use crate::supervised::inertial::{
    CurvatureSlope, InertialEkf, InertialParams, InertialUkf, SigmaParams,
};

use crate::detect::validity::Integrity;
use crate::preprocess::conditioning::ConditioningParams;
use crate::supervised::supervision::Supervision;

params! {
    /// How the inertial slope filter adapts.
    AdaptiveParams {
        b ["-"] = 0.998, 0.5 => 0.99999, "Fading factor b of the adapted wheel-speed noise, per wheel-speed sample.";
    }
}

params! {
    /// Constant forgetting of the curvature.
    ConstantForgetting {
        lambda ["-"] = 0.9, 0.5 => 1.0, "Constant forgetting factor, per regression sample.";
    }
}

params! {
    /// Multiple forgetting of the curvature and an offset.
    MultipleForgetting {
        lambda_curvature ["-"] = 0.9, 0.5 => 1.0, "Forgetting factor of the curvature, per regression sample.";
        lambda_offset ["-"] = 0.995, 0.5 => 1.0, "Forgetting factor of the offset, per regression sample.";
        offset_sd_mps3 ["m/s³"] = 0.01, 1e-6 => 10.0, "Standard deviation of the offset of d(f − v̇)/dt.";
    }
}

variants! {
    /// `dffrls_aukf_robust`: the method.
    dffrls_aukf_robust: DffrlsAukf = CurvatureSlope<InertialUkf, 1>,
        { adaptive: AdaptiveParams, slope: InertialParams, sigma_points: SigmaParams, curvature: CurvatureParams, forgetting: DynamicForgetting, supervision: Supervision, integrity: Integrity, conditioning: ConditioningParams },
        |vehicle, p| {
            let curvature = Curvature::new(vehicle, p.curvature, 0.0, p.forgetting.policy());
            CurvatureSlope::unscented(vehicle, p.slope, curvature, p.sigma_points, Some(p.adaptive.b), &p.supervision.with(p.integrity, p.conditioning))
        };
    /// `dffrls_ukf_robust`: fixed noise.
    dffrls_ukf_robust: DffrlsUkf = CurvatureSlope<InertialUkf, 1>,
        { slope: InertialParams, sigma_points: SigmaParams, curvature: CurvatureParams, forgetting: DynamicForgetting, supervision: Supervision, integrity: Integrity, conditioning: ConditioningParams },
        |vehicle, p| {
            let curvature = Curvature::new(vehicle, p.curvature, 0.0, p.forgetting.policy());
            CurvatureSlope::unscented(vehicle, p.slope, curvature, p.sigma_points, None, &p.supervision.with(p.integrity, p.conditioning))
        };
    /// `dffrls_aekf_inclination_robust`: extended in place of unscented.
    dffrls_aekf_inclination_robust: DffrlsAekfInclination = CurvatureSlope<InertialEkf, 1>,
        { adaptive: AdaptiveParams, slope: InertialParams, curvature: CurvatureParams, forgetting: DynamicForgetting, supervision: Supervision, integrity: Integrity, conditioning: ConditioningParams },
        |vehicle, p| {
            let curvature = Curvature::new(vehicle, p.curvature, 0.0, p.forgetting.policy());
            CurvatureSlope::extended(vehicle, p.slope, curvature, Some(p.adaptive.b), &p.supervision.with(p.integrity, p.conditioning))
        };
    /// `ffrls_aukf_robust`: constant forgetting.
    ffrls_aukf_robust: FfrlsAukf = CurvatureSlope<InertialUkf, 1>,
        { own: ConstantForgetting, adaptive: AdaptiveParams, slope: InertialParams, sigma_points: SigmaParams, curvature: CurvatureParams, supervision: Supervision, integrity: Integrity, conditioning: ConditioningParams },
        |vehicle, p| {
            let curvature = Curvature::new(vehicle, p.curvature, 0.0, Forgetting::Constant(p.own.lambda));
            CurvatureSlope::unscented(vehicle, p.slope, curvature, p.sigma_points, Some(p.adaptive.b), &p.supervision.with(p.integrity, p.conditioning))
        };
    /// `rls_mff_aukf_robust`: multiple forgetting.
    rls_mff_aukf_robust: RlsMffAukf = CurvatureSlope<InertialUkf, 2>,
        { own: MultipleForgetting, adaptive: AdaptiveParams, slope: InertialParams, sigma_points: SigmaParams, curvature: CurvatureParams, supervision: Supervision, integrity: Integrity, conditioning: ConditioningParams },
        |vehicle, p| {
            let policy = Forgetting::Multiple([p.own.lambda_curvature, p.own.lambda_offset]);
            let curvature = Curvature::new(vehicle, p.curvature, p.own.offset_sd_mps3, policy);
            CurvatureSlope::unscented(vehicle, p.slope, curvature, p.sigma_points, Some(p.adaptive.b), &p.supervision.with(p.integrity, p.conditioning))
        };
}
