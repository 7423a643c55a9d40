//! Supervised form of Liu et al. 2023, "Safety performance of unmanned monorail cranes in mines: key parameters
//! identification research", Coal Science and Technology 51(S1): mass by least squares that forget by the residual (eq.
//! 19, [`ForceBalanceRls`]), then slope by an extended Kalman filter with that mass and with adapted wheel-speed noise
//! (Sage & Husa, [`ForceBalanceEkf`]).
//!
//! Differences to the print: the regression runs on the specific force with free intercept, so that a change of slope
//! helps instead of ruining it; the residual that drives the forgetting is measured in its own standard deviations;
//! angles are not taken for small; Sage-Husa adapts R alone, in a form that stays positive.

use crate::api::params::params;
use crate::detect::validity::Integrity;
use crate::filters::forgetting::Forgetting;
use crate::fusion::attitude::params::{AttitudeParams, AttitudeSupervision};
use crate::models::force_balance::ForceBalance;
use crate::preprocess::conditioning::ConditioningParams;
use crate::supervised::force_balance_ekf::{Adaptation, ForceBalanceEkf, GradeParams};
use crate::supervised::force_balance_rls::{ForceBalanceRls, MassParams};
use crate::supervised::pipeline::{CoreParams, Supervised, Supervision};
use crate::supervised::two_stage::{SlipSupervision, TwoStage};

params! {
    /// Forgetting and adaptation of `dffrls_aekf_robust`.
    ForgettingParams {
        lambda0 ["-"] = 0.98, 0.5 => 1.0, "Forgetting factor until the size of the residual is known.";
        delta ["-"] = 0.999, 0.5 => 1.0, "Smallest forgetting factor δ, per regression sample: running resistance and bias, which it forgets with the mass, do not change within minutes; the load-change detector handles another load.";
        sigma ["-"] = 1.0, 0.0 => 1000.0, "Decrease of λ with the residual in units of its standard deviation.";
        kappa ["-"] = 0.98, 0.5 => 0.99999, "Fading factor κ of the adapted wheel-speed noise, per wheel-speed sample.";
    }
}

impl ForgettingParams {
    fn policy(&self) -> Forgetting<4> {
        Forgetting::Dynamic {
            floor: self.delta,
            sharpness: self.sigma,
            first: self.lambda0,
        }
    }
}

variants! {
    /// `dffrls_aekf_robust`: the method of the paper, dynamic forgetting and adapted noise.
    dffrls_aekf_robust: DffrlsAekf = Supervised<TwoStage<ForceBalanceRls>>,
        { forgetting: ForgettingParams, mass: MassParams, slope: GradeParams, slip: SlipSupervision, supervision: Supervision, attitude: AttitudeParams, attitude_supervision: AttitudeSupervision, integrity: Integrity, conditioning: ConditioningParams },
        |vehicle, p| {
            let core = CoreParams {
                attitude: p.attitude,
                attitude_supervision: p.attitude_supervision,
                supervision: p.supervision,
                integrity: p.integrity,
                conditioning: p.conditioning,
            };
            let slope = ForceBalanceEkf::new(
                ForceBalance::new(vehicle),
                p.slope,
                Adaptation::SageHusa { fading: p.forgetting.kappa },
                &p.integrity,
                p.attitude.wheel_speed_sd_mps,
            );
            let mass = ForceBalanceRls::new(vehicle, p.mass, p.forgetting.policy(), p.attitude.accel_bias_sd_mps2);
            Supervised::new(vehicle, &core, p.mass.sampling(), TwoStage::new(vehicle, mass, slope, p.slip.slip_detector))
        };
}
