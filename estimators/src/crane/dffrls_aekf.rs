//! Pipeline `dffrls_aekf`: Liu et al. 2023, "Safety performance of unmanned monorail cranes in mines: key parameters
//! identification research", Coal Science and Technology 51(S1), in the form that works.
//!
//! signals → mass by least squares with residual-driven forgetting ([`MassRegression`]) → slope by an adaptive extended Kalman
//! filter with that mass ([`SlopeFilter`]).
//!
//! Differences to the print: the regression runs on the specific force with free intercept, so that a change of slope helps
//! instead of ruining it; the residual that drives the forgetting is measured in its own standard deviations; angles are not
//! taken for small; Sage-Husa adapts R alone, in a form that stays positive.

use super::{
    Estimator,
    force_balance::ForceBalance,
    front_end::FrontEnd,
    mass_regression::{MassParams, MassRegression},
    mass_then_slope::MassThenSlope,
    params::{Key, ParamError, params},
    slope_filter::{SlopeFilter, SlopeParams},
};
use crate::{
    Error, Real,
    rls::Forgetting,
    signals::{Command, Estimate, Measurements, Vehicle},
};

params! {
    /// How `dffrls_aekf` forgets and adapts.
    DffrlsAekfOwn {
        lambda0 ["-"] = 0.98, 0.5 => 1.0, "Forgetting factor until the size of the residual is known.";
        delta ["-"] = 0.995, 0.5 => 1.0, "Smallest forgetting factor δ, per regression sample.";
        sigma ["-"] = 1.0, 0.0 => 1000.0, "How fast λ falls with the residual in units of its standard deviation.";
        kappa ["-"] = 0.998, 0.5 => 0.99999, "Fading factor κ of the adapted wheel-speed noise, per wheel-speed sample.";
    }
}

/// Parameters of `dffrls_aekf`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DffrlsAekfParams {
    /// Forgetting and adaptation.
    pub own: DffrlsAekfOwn,
    /// Mass regression.
    pub mass: MassParams,
    /// Slope filter.
    pub slope: SlopeParams,
}

impl DffrlsAekfParams {
    /// All keys, in groups.
    pub const KEYS: &'static [&'static [Key]] =
        &[DffrlsAekfOwn::KEYS, MassParams::KEYS, SlopeParams::KEYS];

    /// Sets one parameter by name.
    pub fn set(&mut self, name: &str, value: Real) -> Result<(), ParamError> {
        let known = self.own.set(name, value)?
            || self.mass.set(name, value)?
            || self.slope.set(name, value)?;
        if known {
            Ok(())
        } else {
            Err(ParamError::UnknownKey)
        }
    }
}

/// The pipeline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DffrlsAekf {
    start: MassThenSlope,
    now: MassThenSlope,
}

impl DffrlsAekf {
    /// From the vehicle's nominal values and the parameters.
    pub fn new(vehicle: &Vehicle, params: DffrlsAekfParams) -> Self {
        let balance = ForceBalance::new(vehicle);
        let own = params.own;
        let policy = Forgetting::Dynamic {
            floor: own.delta,
            sharpness: own.sigma,
            first: own.lambda0,
        };
        let start = MassThenSlope {
            front_end: FrontEnd::new(vehicle),
            balance,
            mass: MassRegression::new(vehicle, params.mass, policy),
            slope: SlopeFilter::new(balance, params.slope, Some(own.kappa)),
            standstill_mps: params.mass.standstill_mps,
        };
        Self { start, now: start }
    }
}

impl Estimator for DffrlsAekf {
    fn step(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Estimate, Error> {
        self.now.step(z, u, dt)
    }

    fn reset(&mut self) {
        self.now = self.start;
    }

    fn internals(&self) -> &'static [&'static str] {
        MassThenSlope::INTERNALS
    }

    fn internal_values(&self, values: &mut [Real]) {
        self.now.internal_values(values);
    }
}
