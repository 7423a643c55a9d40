//! Robust forms of Guo, Wang, Zhao & Dai 2024: mass from differences ([`DifferencedParams`]), slope by a kinematic and a dynamic model
//! ([`SlopeModels`]) that interact.
//!
//! | name | models | transitions | filters | bends |
//! |---|---|---|---|---|
//! | `imm_stf_robust`, the method | both | time-varying | strong tracking | corrected |
//! | `imm_stf_fixed_robust` | both | fixed (Blom & Bar-Shalom 1988) | strong tracking | corrected |
//! | `imm_stf_no_lateral_robust`, their baseline | both | time-varying | strong tracking | taken for straights |
//! | `imm_ekf_robust` | both | time-varying | plain Kalman | corrected |
//! | `imm_ekf_fixed_robust` | both | fixed | plain Kalman | corrected |
//! | `kinematic_stf_robust` | kinematic | – | strong tracking | corrected |
//! | `dynamic_stf_robust` | dynamic | – | strong tracking | corrected |
//!
//! Bends are those of a road: on a rail `imm_stf_no_lateral_robust` is `imm_stf_robust`. The models are linear once the cosine of the
//! combined estimate is put in, so that the extended filter is the plain one. Where there is no force balance (standing, braking, torque
//! unknown) the dynamic model goes on as the kinematic one.

use crate::detect::validity::Integrity;
use crate::preprocess::conditioning::ConditioningParams;
use crate::supervised::differenced_rls::DifferencedParams;
use crate::supervised::imm::{
    Acceleration, Choice, ImmParams, ModelParams, SlopeModels, TrackingParams,
};
use crate::supervised::supervision::Supervision;

variants! {
    /// `imm_stf_robust`: the method.
    imm_stf_robust: ImmStf = SlopeModels<2>,
        { imm: ImmParams, models: ModelParams, tracking: TrackingParams, mass: DifferencedParams, supervision: Supervision, integrity: Integrity, conditioning: ConditioningParams },
        |vehicle, p| SlopeModels::new(vehicle, p.models, p.mass, both(&p.imm, Some(p.tracking)), &p.supervision.with(p.integrity, p.conditioning));
    /// `imm_stf_fixed_robust`: fixed transition probabilities.
    imm_stf_fixed_robust: ImmStfFixed = SlopeModels<2>,
        { imm: ImmParams, models: ModelParams, tracking: TrackingParams, mass: DifferencedParams, supervision: Supervision, integrity: Integrity, conditioning: ConditioningParams },
        |vehicle, p| {
            let choice = Choice { time_varying: false, ..both(&p.imm, Some(p.tracking)) };
            SlopeModels::new(vehicle, p.models, p.mass, choice, &p.supervision.with(p.integrity, p.conditioning))
        };
    /// `imm_stf_no_lateral_robust`: bends taken for straights.
    imm_stf_no_lateral_robust: ImmStfNoLateral = SlopeModels<2>,
        { imm: ImmParams, models: ModelParams, tracking: TrackingParams, mass: DifferencedParams, supervision: Supervision, integrity: Integrity, conditioning: ConditioningParams },
        |vehicle, p| {
            let choice = Choice { lateral: false, ..both(&p.imm, Some(p.tracking)) };
            SlopeModels::new(vehicle, p.models, p.mass, choice, &p.supervision.with(p.integrity, p.conditioning))
        };
    /// `imm_ekf_robust`: plain Kalman filters.
    imm_ekf_robust: ImmEkf = SlopeModels<2>,
        { imm: ImmParams, models: ModelParams, mass: DifferencedParams, supervision: Supervision, integrity: Integrity, conditioning: ConditioningParams },
        |vehicle, p| SlopeModels::new(vehicle, p.models, p.mass, both(&p.imm, None), &p.supervision.with(p.integrity, p.conditioning));
    /// `imm_ekf_fixed_robust`: plain Kalman filters, fixed transition probabilities.
    imm_ekf_fixed_robust: ImmEkfFixed = SlopeModels<2>,
        { imm: ImmParams, models: ModelParams, mass: DifferencedParams, supervision: Supervision, integrity: Integrity, conditioning: ConditioningParams },
        |vehicle, p| {
            let choice = Choice { time_varying: false, ..both(&p.imm, None) };
            SlopeModels::new(vehicle, p.models, p.mass, choice, &p.supervision.with(p.integrity, p.conditioning))
        };
    /// `kinematic_stf_robust`: the kinematic model alone.
    kinematic_stf_robust: KinematicStf = SlopeModels<1>,
        { models: ModelParams, tracking: TrackingParams, mass: DifferencedParams, supervision: Supervision, integrity: Integrity, conditioning: ConditioningParams },
        |vehicle, p| SlopeModels::new(vehicle, p.models, p.mass, alone(Acceleration::Kinematic, p.tracking), &p.supervision.with(p.integrity, p.conditioning));
    /// `dynamic_stf_robust`: the dynamic model alone.
    dynamic_stf_robust: DynamicStf = SlopeModels<1>,
        { models: ModelParams, tracking: TrackingParams, mass: DifferencedParams, supervision: Supervision, integrity: Integrity, conditioning: ConditioningParams },
        |vehicle, p| SlopeModels::new(vehicle, p.models, p.mass, alone(Acceleration::Dynamic, p.tracking), &p.supervision.with(p.integrity, p.conditioning));
}

/// Both models with time-varying transitions, corrected for bends.
fn both(imm: &ImmParams, tracking: Option<TrackingParams>) -> Choice<2> {
    Choice {
        models: [Acceleration::Kinematic, Acceleration::Dynamic],
        stay: imm.stay,
        time_varying: true,
        tracking,
        lateral: true,
    }
}

/// One model with strong tracking, corrected for bends.
fn alone(model: Acceleration, tracking: TrackingParams) -> Choice<1> {
    Choice {
        models: [model],
        stay: 1.0,
        time_varying: false,
        tracking: Some(tracking),
        lateral: true,
    }
}
