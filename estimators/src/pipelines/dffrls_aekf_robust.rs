//! `dffrls_aekf_robust`: Liu et al. 2023, "Safety performance of unmanned monorail cranes in mines: key parameters identification
//! research", Coal Science and Technology 51(S1), in the form that works.
//!
//! signals → mass by least squares with residual-driven forgetting ([`ForceBalanceRls`]) → slope by an adaptive extended Kalman
//! filter with that mass ([`ForceBalanceEkf`]).
//!
//! Differences to the print: the regression runs on the specific force with free intercept, so that a change of slope helps
//! instead of ruining it; the residual that drives the forgetting is measured in its own standard deviations; angles are not
//! taken for small; Sage-Husa adapts R alone, in a form that stays positive.

use crate::api::params::{param_groups, params};
use crate::api::signals::Vehicle;
use crate::filters::forgetting::Forgetting;
use crate::grade::force_balance_ekf::{Adaptation, ForceBalanceEkf, GradeParams};
use crate::mass::force_balance_rls::{ForceBalanceRls, MassParams};
use crate::models::distributed_train::DistributedTrain;
use crate::models::force_balance::ForceBalance;
use crate::pipelines::two_stage::TwoStage;

params! {
    /// How `dffrls_aekf_robust` forgets and adapts.
    Own {
        lambda0 ["-"] = 0.98, 0.5 => 1.0, "Forgetting factor until the size of the residual is known.";
        delta ["-"] = 0.995, 0.5 => 1.0, "Smallest forgetting factor δ, per regression sample.";
        sigma ["-"] = 1.0, 0.0 => 1000.0, "How fast λ falls with the residual in units of its standard deviation.";
        kappa ["-"] = 0.98, 0.5 => 0.99999, "Fading factor κ of the adapted wheel-speed noise, per wheel-speed sample.";
    }
}

param_groups! {
    /// Parameters of `dffrls_aekf_robust`.
    Params { own: Own, mass: MassParams, slope: GradeParams }
}

/// The pipeline.
pub type DffrlsAekf = TwoStage<ForceBalanceRls>;

/// From the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> DffrlsAekf {
    let balance = ForceBalance::new(vehicle);
    let own = params.own;
    let policy = Forgetting::Dynamic {
        floor: own.delta,
        sharpness: own.sigma,
        first: own.lambda0,
    };
    let own = &params.mass;
    TwoStage::new(
        vehicle,
        ForceBalanceRls::resampler(own),
        DistributedTrain::new(vehicle, own.standstill_mps),
        ForceBalanceRls::new(vehicle, *own, policy),
        ForceBalanceEkf::new(
            balance,
            params.slope,
            Adaptation::sage_husa(params.own.kappa),
        ),
        own.standstill_mps,
    )
}
