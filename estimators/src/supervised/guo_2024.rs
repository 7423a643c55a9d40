//! Supervised form of Guo, Wang, Zhao & Dai 2024: mass from differences ([`DifferencedParams`]), slope by a kinematic
//! and a dynamic model that interact ([`SlopeModels`]), with time-varying transitions, strong tracking and a correction
//! for bends.
//!
//! The models are linear once the cosine of the combined estimate is put in, so that the extended filter is the plain
//! one. Where there is no force balance (standing, braking, torque unknown) the dynamic model goes on as the kinematic
//! one.

use crate::detect::validity::Integrity;
use crate::fusion::attitude::params::{AttitudeParams, AttitudeSupervision};
use crate::preprocess::conditioning::ConditioningParams;
use crate::supervised::differenced_rls::DifferencedParams;
use crate::supervised::imm::{ImmParams, ModelParams, SlopeModels, TrackingParams};
use crate::supervised::pipeline::{CoreParams, Supervised, Supervision};

variants! {
    /// `imm_stf_robust`: the method.
    imm_stf_robust: ImmStf = Supervised<SlopeModels>,
        { imm: ImmParams, models: ModelParams, tracking: TrackingParams, mass: DifferencedParams, supervision: Supervision, attitude: AttitudeParams, attitude_supervision: AttitudeSupervision, integrity: Integrity, conditioning: ConditioningParams },
        |vehicle, p| {
            let core = CoreParams {
                attitude: p.attitude,
                attitude_supervision: p.attitude_supervision,
                supervision: p.supervision,
                integrity: p.integrity,
                conditioning: p.conditioning,
            };
            Supervised::new(vehicle, &core, p.mass.sampling(), SlopeModels::new(vehicle, p.models, p.mass, p.imm, p.tracking, &p.integrity, p.attitude.wheel_speed_sd_mps))
        };
}
