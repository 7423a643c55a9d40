//! Estimators by name, behind the cargo feature `registry`: names, parameter keys, construction.
//!
//! Firmware does not need it: firmware names one pipeline and its parameters in code ([`Runner::new`]), and pays for
//! that one. To add a name: write its file with `Params`, a pipeline type and `new`, and give it a line in `registry!`
//! with the cargo feature of its source.

use crate::api::aid::AidStatus;
use crate::api::estimator::{Estimator, Internal};
use crate::api::params::{Key, Name, ParamError, Parameters, Setting};
use crate::api::signals::{Command, Estimate, Measurements};
use crate::api::snapshot::SnapshotError;
use crate::api::vehicle::Vehicle;
#[cfg(feature = "rail_fusion")]
use crate::fusion::{attitude_alone as attitude, rail_fusion};
#[cfg(feature = "guo2024")]
use crate::methods::guo_2024::{
    dynamic_stf, imm_ekf, imm_ekf_fixed, imm_stf, imm_stf_fixed, imm_stf_no_lateral, kinematic_stf,
};
#[cfg(feature = "huainan")]
use crate::methods::huainan::{
    dffrls_aekf_inclination, dffrls_aukf, dffrls_ukf, ffrls_aukf, rls_mff_aukf,
};
#[cfg(feature = "liu2023")]
use crate::methods::joint_ekf::joint_ekf;
#[cfg(feature = "liu2023")]
use crate::methods::liu_2023::{dffrls_aekf, ffrls, rls_ekf};
#[cfg(feature = "resistance")]
use crate::methods::liu_2023_resistance::resistance_dffrls;
#[cfg(feature = "patent")]
use crate::methods::patent::mmrls_sh_stf;
#[cfg(feature = "baseline")]
use crate::methods::{complementary_filter, ekf_v_theta_biases};
#[cfg(feature = "printed")]
use crate::printed::{guo_2024, huainan, liu_2023, liu_2023_resistance, patent};
use crate::runner::Runner;
#[cfg(feature = "liu2023")]
use crate::supervised::liu_2023::dffrls_aekf_robust;
use crate::{Error, Real};

/// Kind of a named estimator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// An estimator of this project for use: its marks go by the validity rule ([`crate::detect::validity`]).
    Ours,
    /// A published method under supervision, for use: its marks go by the same rule.
    Supervised,
    /// A textbook filter for comparison: its marks go by the same rule.
    Baseline,
    /// A published method with only its errata corrected: it marks what it has found at all.
    Published,
    /// A published method letter by letter.
    Printed,
}

impl Kind {
    /// Returns true if an estimator of the kind marks its values by the validity rule ([`crate::detect::validity`]).
    pub fn has_validity_rule(self) -> bool {
        matches!(self, Kind::Ours | Kind::Supervised | Kind::Baseline)
    }
}

/// From one list: the names, the key tables, the construction and the enum of all estimators.
macro_rules! registry {
    (
        { $($(#[doc = $about:literal])* $name:literal in $family:literal as $kind:ident => $module:ident::$pipeline:ident,)* }
        as printed:
        { $($(#[doc = $print_about:literal])* $print_name:literal => $print_module:ident::$print:ident,)* }
    ) => {
        /// Names that [`build`] accepts.
        pub const NAMES: &[&str] = &[$(#[cfg(feature = $family)] $name),*];

        /// Further names that [`build`] accepts with the feature `printed`: methods as printed, slips and all. None
        /// without it.
        pub const PRINTED_NAMES: &[&str] = &[$(#[cfg(feature = "printed")] $print_name),*];

        /// The parameters of a named estimator, in groups; `None` for an unknown estimator.
        pub fn key_groups(name: &str) -> Option<&'static [&'static [Key]]> {
            match name {
                $(#[cfg(feature = $family)] $name => Some(<$module::Params as Parameters>::GROUPS),)*
                $(#[cfg(feature = "printed")] $print_name => Some(<$print_module::Params as Parameters>::GROUPS),)*
                _ => None,
            }
        }

        /// Returns the kind of a named estimator; `None` for an unknown estimator.
        pub fn kind(name: &str) -> Option<Kind> {
            match name {
                $(#[cfg(feature = $family)] $name => Some(Kind::$kind),)*
                $(#[cfg(feature = "printed")] $print_name => Some(Kind::Printed),)*
                _ => None,
            }
        }

        /// Describes a named estimator in a sentence; `None` for an unknown estimator.
        pub fn about(name: &str) -> Option<&'static str> {
            match name {
                $(#[cfg(feature = $family)] $name => Some(concat!($($about),*).trim()),)*
                $(#[cfg(feature = "printed")] $print_name => Some(concat!($($print_about),*).trim()),)*
                _ => None,
            }
        }

        /// Builds an estimator by name, with the parameters in `settings` and defaults for the others.
        pub fn build<'a>(
            name: &str,
            vehicle: &Vehicle,
            settings: impl IntoIterator<Item = (&'a str, Setting<'a>)>,
        ) -> Result<AnyEstimator, ParamError> {
            match name {
                $(#[cfg(feature = $family)] $name => {
                    let mut params = $module::Params::default();
                    settings.into_iter().try_for_each(|(key, value)| params.set(key, value))?;
                    Ok(AnyEstimator::$pipeline(Runner::new($name, $module::new, vehicle, &params)))
                })*
                $(#[cfg(feature = "printed")] $print_name => {
                    let mut params = $print_module::Params::default();
                    settings.into_iter().try_for_each(|(key, value)| params.set(key, value))?;
                    Ok(AnyEstimator::$print(Runner::new($print_name, $print_module::new, vehicle, &params)))
                })*
                _ => Err(ParamError::UnknownEstimator(Name::new(name))),
            }
        }

        /// A named estimator of any type, without a heap.
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[allow(clippy::large_enum_variant)]
        pub enum AnyEstimator {
            $(#[cfg(feature = $family)] $(#[doc = $about])* $pipeline(Runner<$module::$pipeline, $module::Params>),)*
            $(#[cfg(feature = "printed")] $(#[doc = $print_about])* $print(Runner<$print_module::$print, $print_module::Params>),)*
        }

        impl AnyEstimator {
            fn inner(&self) -> &dyn Estimator {
                match self {
                    $(#[cfg(feature = $family)] AnyEstimator::$pipeline(estimator) => estimator,)*
                    $(#[cfg(feature = "printed")] AnyEstimator::$print(estimator) => estimator,)*
                }
            }

            /// The name with which the estimator was built.
            pub fn name(&self) -> &'static str {
                match self {
                    $(#[cfg(feature = $family)] AnyEstimator::$pipeline(_) => $name,)*
                    $(#[cfg(feature = "printed")] AnyEstimator::$print(_) => $print_name,)*
                }
            }

            fn inner_mut(&mut self) -> &mut dyn Estimator {
                match self {
                    $(#[cfg(feature = $family)] AnyEstimator::$pipeline(estimator) => estimator,)*
                    $(#[cfg(feature = "printed")] AnyEstimator::$print(estimator) => estimator,)*
                }
            }
        }
    };
}

registry! {{
    /// Liu et al. 2023: least squares with dynamic forgetting, then an adaptive extended Kalman filter.
    "dffrls_aekf" in "liu2023" as Published => dffrls_aekf::DffrlsAekfPublished,
    /// Baseline of Liu et al. 2023: plain least squares, then an extended Kalman filter.
    "rls_ekf" in "liu2023" as Published => rls_ekf::RlsEkfPublished,
    /// Baseline of Liu et al. 2023: one regression with constant forgetting for both.
    "ffrls" in "liu2023" as Published => ffrls::FfrlsPublished,
    /// Baseline of Liu et al. 2023: one extended Kalman filter for both.
    "joint_ekf" in "liu2023" as Published => joint_ekf::JointEkfPublished,
    /// Curvature by least squares, slope by an adaptive unscented filter on accelerometer and wheel speed.
    "dffrls_aukf" in "huainan" as Published => dffrls_aukf::DffrlsAukfPublished,
    /// `dffrls_aukf` with fixed noise.
    "dffrls_ukf" in "huainan" as Published => dffrls_ukf::DffrlsUkfPublished,
    /// `dffrls_aukf` with an extended filter.
    "dffrls_aekf_inclination" in "huainan" as Published => dffrls_aekf_inclination::DffrlsAekfInclinationPublished,
    /// `dffrls_aukf` with constant forgetting.
    "ffrls_aukf" in "huainan" as Published => ffrls_aukf::FfrlsAukfPublished,
    /// `dffrls_aukf` with multiple forgetting.
    "rls_mff_aukf" in "huainan" as Published => rls_mff_aukf::RlsMffAukfPublished,
    /// Guo et al. 2024: mass from differences, slope by interacting strong-tracking filters.
    "imm_stf" in "guo2024" as Published => imm_stf::ImmStfPublished,
    /// `imm_stf` with fixed transitions between the models.
    "imm_stf_fixed" in "guo2024" as Published => imm_stf_fixed::ImmStfFixedPublished,
    /// `imm_stf` without correction for bends.
    "imm_stf_no_lateral" in "guo2024" as Published => imm_stf_no_lateral::ImmStfNoLateralPublished,
    /// `imm_stf` with plain Kalman filters.
    "imm_ekf" in "guo2024" as Published => imm_ekf::ImmEkfPublished,
    /// `imm_stf` with plain Kalman filters and fixed transitions.
    "imm_ekf_fixed" in "guo2024" as Published => imm_ekf_fixed::ImmEkfFixedPublished,
    /// The kinematic model of `imm_stf` alone.
    "kinematic_stf" in "guo2024" as Published => kinematic_stf::KinematicStfPublished,
    /// The dynamic model of `imm_stf` alone.
    "dynamic_stf" in "guo2024" as Published => dynamic_stf::DynamicStfPublished,
    /// Patent CN 111507019 B: mass by two weighted models, slope by Sage-Husa and strong tracking in turn.
    "mmrls_sh_stf" in "patent" as Published => mmrls_sh_stf::MmrlsShStfPublished,
    /// Liu et al. 2023, section 2.2: running resistance of a train of known mass by least squares with dynamic
    /// forgetting.
    "resistance_dffrls" in "resistance" as Published => resistance_dffrls::ResistancePublished,
    /// Liu et al. 2023: least squares with dynamic forgetting, then an adaptive extended Kalman filter.
    "dffrls_aekf_robust" in "liu2023" as Supervised => dffrls_aekf_robust::DffrlsAekf,
    /// Ours: attitude filter, rail memory, force balance with a swinging load.
    "rail_fusion" in "rail_fusion" as Ours => rail_fusion::RailFusion,
    /// Ours: attitude filter alone (gyro, accelerometer, wheels), on a rail or a road.
    "attitude" in "rail_fusion" as Ours => attitude::AttitudePipeline,
    /// Baseline: textbook extended Kalman filter for speed, grade and the biases of gyro and accelerometer; no mass.
    "ekf_v_theta_biases" in "baseline" as Baseline => ekf_v_theta_biases::EkfVThetaBiases,
    /// Baseline: gyro for fast changes, accelerometer minus acceleration of the wheels for slow changes; no mass.
    "complementary_filter" in "baseline" as Baseline => complementary_filter::ComplementaryFilter,
} as printed: {
    /// Liu et al. 2023 as printed.
    "dffrls_aekf_printed" => liu_2023::DffrlsAekfPrinted,
    /// Liu et al. 2023, section 2.2, as printed.
    "resistance_dffrls_printed" => liu_2023_resistance::ResistancePrinted,
    /// The DFFRLS-AUKF paper as printed.
    "dffrls_aukf_printed" => huainan::DffrlsAukfPrinted,
    /// Guo et al. 2024 as printed.
    "imm_stf_printed" => guo_2024::ImmStfPrinted,
    /// Patent CN 111507019 B as printed.
    "mmrls_sh_stf_printed" => patent::MmrlsShStfPrinted,
}}

/// The parameters of a named estimator; `None` if there is no such estimator.
pub fn keys(name: &str) -> Option<impl Iterator<Item = &'static Key>> {
    key_groups(name).map(|groups| groups.iter().copied().flatten())
}

impl Estimator for AnyEstimator {
    fn step(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Estimate, Error> {
        self.inner_mut().step(z, u, dt)
    }

    fn reset(&mut self) {
        self.inner_mut().reset();
    }

    fn internals(&self) -> &[Internal] {
        self.inner().internals()
    }

    fn internal_values(&self, values: &mut [Real]) {
        self.inner().internal_values(values);
    }

    fn aid_sources(&self) -> &[&'static str] {
        self.inner().aid_sources()
    }

    fn aid_status(&self, status: &mut [AidStatus]) {
        self.inner().aid_status(status);
    }

    fn snapshot(&self, bytes: &mut [u8]) -> Result<usize, SnapshotError> {
        self.inner().snapshot(bytes)
    }

    fn restore(&mut self, snapshot: &[u8]) -> Result<(), SnapshotError> {
        self.inner_mut().restore(snapshot)
    }
}
