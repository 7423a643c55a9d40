//! Estimators of a crane's mass and slope, constructed by name.
//!
//! A pipeline gets checked and merged signals ([`front_end`], [`hosted`]), knows the [`force_balance`], and puts algorithms of this
//! crate together. To add one: write its file with `Params`, a pipeline type and `new`, and give it a line in
//! `registry!`.

pub mod conditioner;
pub mod curvature;
pub mod curvature_ukf;
pub mod dffrls_aekf;
pub mod dffrls_aukf;
pub mod dffrls_ukf;
pub mod differenced_mass;
pub mod ffrls;
pub mod force_balance;
pub mod front_end;
pub mod hosted;
pub mod imm_stf;
pub mod joint_ekf;
pub mod load_watch;
pub mod mass_regression;
pub mod mass_then_slope;
pub mod mmrls_sh_stf;
pub mod multi_model_mass;
pub mod params;
pub mod resistance;
pub mod rls_ekf;
pub mod slope_filter;
#[cfg(test)]
pub(crate) mod testing;
pub mod train_on_rail;
pub mod waiting;

use crate::{
    Error, Real,
    signals::{Command, Estimate, MAX_DRIVES, Measurements, Vehicle},
};
use hosted::Hosted;
use params::{Key, ParamError};

/// An estimator of mass and slope.
pub trait Estimator {
    /// One step of `dt` seconds with the samples that came since the last one. On an error the estimator is as it was.
    fn step(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Estimate, Error>;

    /// Back to the state it was built in.
    fn reset(&mut self);

    /// Names of its internal quantities, for plots.
    fn internals(&self) -> &'static [&'static str];

    /// Writes the internal quantities, in the order of their names, into `values`; as many as fit.
    fn internal_values(&self, values: &mut [Real]);
}

/// From one list: the names, the key tables, the construction and the enum of all estimators.
macro_rules! registry {
    ($($(#[$about:meta])* $name:literal => $module:ident::$pipeline:ident,)*) => {
        /// Names [`build`] knows.
        pub const NAMES: &[&str] = &[$($name),*];

        /// The parameters of a named estimator, in groups; `None` if there is no such estimator.
        pub fn key_groups(name: &str) -> Option<&'static [&'static [Key]]> {
            match name {
                $($name => Some($module::Params::KEYS),)*
                _ => None,
            }
        }

        /// Builds an estimator by name, with the parameters named in `settings` and the defaults of the rest.
        pub fn build<'a>(
            name: &str,
            vehicle: &Vehicle,
            settings: impl IntoIterator<Item = (&'a str, Real)>,
        ) -> Result<AnyEstimator, ParamError> {
            check(vehicle)?;
            match name {
                $($name => {
                    let mut params = $module::Params::default();
                    settings.into_iter().try_for_each(|(key, value)| params.set(key, value))?;
                    Ok(AnyEstimator::$pipeline(Hosted::new(vehicle, $module::new(vehicle, &params))))
                })*
                _ => Err(ParamError::UnknownEstimator),
            }
        }

        /// Any of the named estimators, without a heap.
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[allow(clippy::large_enum_variant)]
        pub enum AnyEstimator {
            $($(#[$about])* $pipeline(Hosted<$module::$pipeline>),)*
        }

        impl AnyEstimator {
            fn inner(&self) -> &dyn Estimator {
                match self {
                    $(AnyEstimator::$pipeline(estimator) => estimator,)*
                }
            }

            fn inner_mut(&mut self) -> &mut dyn Estimator {
                match self {
                    $(AnyEstimator::$pipeline(estimator) => estimator,)*
                }
            }
        }
    };
}

registry! {
    /// Liu et al. 2023: least squares with dynamic forgetting, then an adaptive extended Kalman filter.
    "dffrls_aekf" => dffrls_aekf::DffrlsAekf,
    /// Baseline of Liu et al. 2023: plain least squares, then an extended Kalman filter.
    "rls_ekf" => rls_ekf::RlsEkf,
    /// Baseline of Liu et al. 2023: one regression with constant forgetting for both.
    "ffrls" => ffrls::Ffrls,
    /// Baseline of Liu et al. 2023: one extended Kalman filter for both.
    "joint_ekf" => joint_ekf::JointEkf,
    /// Curvature by least squares, slope by an adaptive unscented filter on accelerometer and wheel speed.
    "dffrls_aukf" => dffrls_aukf::DffrlsAukf,
    /// The same with fixed noise.
    "dffrls_ukf" => dffrls_ukf::DffrlsUkf,
    /// Guo et al. 2024: mass from differences, slope by interacting strong-tracking filters.
    "imm_stf" => imm_stf::ImmStf,
    /// Patent CN 111507019 B: mass by two weighed models, slope by Sage-Husa and strong tracking in turn.
    "mmrls_sh_stf" => mmrls_sh_stf::MmrlsShStf,
    /// Liu et al. 2023, section 2.2: running resistance of a train of known mass by least squares with dynamic forgetting.
    "resistance_dffrls" => resistance::Resistance,
}

/// The parameters of a named estimator; `None` if there is no such estimator.
pub fn keys(name: &str) -> Option<impl Iterator<Item = &'static Key>> {
    key_groups(name).map(|groups| groups.iter().copied().flatten())
}

/// No train is longer, m.
const LONGEST_M: Real = 1e3;

fn check(vehicle: &Vehicle) -> Result<(), ParamError> {
    let [low, high] = vehicle.mass_range_kg;
    let positive = |value: Real| value > 0.0 && value.is_finite();
    let span = |[near, far]: [Real; 2]| near <= far && near > -LONGEST_M && far < LONGEST_M;
    for (field, good) in [
        ("tare_kg", positive(vehicle.tare_kg)),
        ("drives", (1..=MAX_DRIVES).contains(&vehicle.drives)),
        ("wheel_radius_m", positive(vehicle.wheel_radius_m)),
        ("gear_ratio", positive(vehicle.gear_ratio)),
        (
            "efficiency",
            positive(vehicle.efficiency) && vehicle.efficiency <= 1.0,
        ),
        (
            "rotating_mass_kg",
            vehicle.rotating_mass_kg >= 0.0 && vehicle.rotating_mass_kg.is_finite(),
        ),
        (
            "running_resistance",
            (0.0..=1.0).contains(&vehicle.running_resistance),
        ),
        (
            "mass_range_kg",
            positive(low) && high > low && high.is_finite(),
        ),
        ("tare_span_m", span(vehicle.tare_span_m)),
        ("load_span_m", span(vehicle.load_span_m)),
        ("imu_arm_m", vehicle.imu_arm_m.abs() < LONGEST_M),
    ] {
        if !good {
            return Err(ParamError::Vehicle(field));
        }
    }
    Ok(())
}

impl Estimator for AnyEstimator {
    fn step(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Estimate, Error> {
        self.inner_mut().step(z, u, dt)
    }

    fn reset(&mut self) {
        self.inner_mut().reset();
    }

    fn internals(&self) -> &'static [&'static str] {
        self.inner().internals()
    }

    fn internal_values(&self, values: &mut [Real]) {
        self.inner().internal_values(values);
    }
}

#[cfg(test)]
mod behaviour;
#[cfg(test)]
mod tests;
