//! Robust form of patent CN 111507019 B (Beijing Institute of Technology, 2022), "iterative joint estimation of vehicle
//! mass and road slope": mass by two models weighed by likelihood ([`MultiModelMass`]), slope by an extended Kalman
//! filter that switches between Sage-Husa and strong tracking ([`ForceBalanceEkf`]).
//!
//! The formulas are reconstructed: those of the published text are pictures, and the switching criterion is cut off;
//! here strong tracking takes over while innovations are too large and keep to one side.

use crate::api::params::params;
use crate::detect::validity::Integrity;
use crate::fusion::attitude::params::{AttitudeParams, AttitudeSupervision};
use crate::models::force_balance::ForceBalance;
use crate::preprocess::conditioning::ConditioningParams;
use crate::supervised::force_balance_ekf::{Adaptation, ForceBalanceEkf, GradeParams};
use crate::supervised::multi_model_rls::{MultiModelMass, MultiModelParams};
use crate::supervised::pipeline::{CoreParams, Supervised, Supervision};
use crate::supervised::two_stage::{SlipSupervision, TwoStage};

params! {
    /// Adaptation of `mmrls_sh_stf_robust`.
    SwitchParams {
        b ["-"] = 0.998, 0.5 => 0.99999, "Fading factor b of Sage-Husa, per wheel-speed sample.";
        memory ["-"] = 0.95, 0.0 => 1.0, "Memory ρ of strong tracking.";
        weakening ["-"] = 1.5, 1.0 => 100.0, "Weakening factor β of strong tracking.";
        alarm ["-"] = 2.0, 1.0 => 1e6, "Smoothed normalised innovation squared above which strong tracking takes over.";
    }
}

variants! {
    /// `mmrls_sh_stf_robust`: the method.
    mmrls_sh_stf_robust: MmrlsShStf = Supervised<TwoStage<MultiModelMass>>,
        { switch: SwitchParams, mass: MultiModelParams, slope: GradeParams, slip: SlipSupervision, supervision: Supervision, attitude: AttitudeParams, attitude_supervision: AttitudeSupervision, integrity: Integrity, conditioning: ConditioningParams },
        |vehicle, p| {
            let core = CoreParams {
                attitude: p.attitude,
                attitude_supervision: p.attitude_supervision,
                supervision: p.supervision,
                integrity: p.integrity,
                conditioning: p.conditioning,
            };
            let slope = ForceBalanceEkf::new(ForceBalance::new(vehicle), p.slope, p.switch.adaptation(), &p.integrity, p.attitude.wheel_speed_sd_mps);
            let mass = MultiModelMass::new(vehicle, p.mass, p.attitude.accel_bias_sd_mps2);
            Supervised::new(vehicle, &core, p.mass.sampling(), TwoStage::new(vehicle, mass, slope, p.slip.slip_detector))
        };
}

impl SwitchParams {
    fn adaptation(&self) -> Adaptation {
        Adaptation::Switched {
            fading: self.b,
            memory: self.memory,
            weakening: self.weakening,
            alarm: self.alarm,
        }
    }
}
