//! Estimators of a crane's mass and slope, constructed by name.
//!
//! A pipeline gets checked and merged signals ([`front_end`], [`hosted`]), knows the [`force_balance`], and puts algorithms of this
//! crate together. To add one: write its file with `Params`, a pipeline type and `new`, and give it a line in
//! `registry!`.

use crate::api::estimator::Estimator;
use crate::api::params::{Key, Name, ParamError, Parameters, Setting};
use crate::api::signals::{Command, Estimate, MAX_DRIVES, Measurements, RoadVehicle, Vehicle};
use crate::api::snapshot::{Archive, Fingerprint, SnapshotError, State};
use crate::pipelines::guo_2024_robust::{
    dynamic_stf_robust, imm_ekf_fixed_robust, imm_ekf_robust, imm_stf_fixed_robust,
    imm_stf_no_lateral_robust, imm_stf_robust, kinematic_stf_robust,
};
use crate::pipelines::huainan_robust::{
    dffrls_aekf_inclination_robust, dffrls_aukf_robust, dffrls_ukf_robust, ffrls_aukf_robust,
    rls_mff_aukf_robust,
};
use crate::pipelines::liu_2023_robust::{dffrls_aekf_robust, rls_ekf_robust};
use crate::pipelines::patent_robust::mmrls_sh_stf_robust;
use crate::pipelines::runner::Runner;
use crate::pipelines::{ffrls_robust, joint_ekf_robust, regression, resistance_robust};
#[cfg(feature = "printed")]
use crate::published::{guo_2024, huainan, liu_2023, liu_2023_resistance, patent};
use crate::{Error, Real};

/// From one list: the names, the key tables, the construction and the enum of all estimators.
macro_rules! registry {
    (
        { $($(#[$about:meta])* $name:literal => $module:ident::$pipeline:ident,)* }
        as printed:
        { $($(#[$print_about:meta])* $print_name:literal => $print_module:ident::$print:ident,)* }
    ) => {
        /// Names [`build`] knows.
        pub const NAMES: &[&str] = &[$($name),*];

        /// Names it also knows with the feature `printed`: methods as printed, slips and all. None without it.
        pub const PRINTED_NAMES: &[&str] = &[$(#[cfg(feature = "printed")] $print_name),*];

        /// The parameters of a named estimator, in groups; `None` if there is no such estimator.
        pub fn key_groups(name: &str) -> Option<&'static [&'static [Key]]> {
            match name {
                $($name => Some(<$module::Params as Parameters>::GROUPS),)*
                $(#[cfg(feature = "printed")] $print_name => Some(<$print_module::Params as Parameters>::GROUPS),)*
                _ => None,
            }
        }

        /// Builds an estimator by name, with the parameters named in `settings` and the defaults of the rest.
        pub fn build<'a>(
            name: &str,
            vehicle: &Vehicle,
            settings: impl IntoIterator<Item = (&'a str, Setting<'a>)>,
        ) -> Result<AnyEstimator, ParamError> {
            check(vehicle)?;
            match name {
                $($name => {
                    let mut params = $module::Params::default();
                    settings.into_iter().try_for_each(|(key, value)| params.set(key, value))?;
                    Ok(AnyEstimator::$pipeline(Runner::new(vehicle, $module::new(vehicle, &params))))
                })*
                $(#[cfg(feature = "printed")] $print_name => {
                    let mut params = $print_module::Params::default();
                    settings.into_iter().try_for_each(|(key, value)| params.set(key, value))?;
                    Ok(AnyEstimator::$print(Runner::new(vehicle, $print_module::new(vehicle, &params))))
                })*
                _ => Err(ParamError::UnknownEstimator(Name::new(name))),
            }
        }

        /// Any of the named estimators, without a heap.
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[allow(clippy::large_enum_variant)]
        pub enum AnyEstimator {
            $($(#[$about])* $pipeline(Runner<$module::$pipeline>),)*
            $(#[cfg(feature = "printed")] $(#[$print_about])* $print(Runner<$print_module::$print>),)*
        }

        impl AnyEstimator {
            fn inner(&self) -> &dyn Estimator {
                match self {
                    $(AnyEstimator::$pipeline(estimator) => estimator,)*
                    $(#[cfg(feature = "printed")] AnyEstimator::$print(estimator) => estimator,)*
                }
            }

            /// The name it was built by.
            pub fn name(&self) -> &'static str {
                match self {
                    $(AnyEstimator::$pipeline(_) => $name,)*
                    $(#[cfg(feature = "printed")] AnyEstimator::$print(_) => $print_name,)*
                }
            }

            fn fingerprint(&self) -> u64 {
                match self {
                    $(AnyEstimator::$pipeline(estimator) => estimator.fingerprint(),)*
                    $(#[cfg(feature = "printed")] AnyEstimator::$print(estimator) => estimator.fingerprint(),)*
                }
            }

            fn visit(&mut self, archive: &mut Archive) {
                match self {
                    $(AnyEstimator::$pipeline(estimator) => estimator.visit(archive),)*
                    $(#[cfg(feature = "printed")] AnyEstimator::$print(estimator) => estimator.visit(archive),)*
                }
            }

            fn inner_mut(&mut self) -> &mut dyn Estimator {
                match self {
                    $(AnyEstimator::$pipeline(estimator) => estimator,)*
                    $(#[cfg(feature = "printed")] AnyEstimator::$print(estimator) => estimator,)*
                }
            }
        }
    };
}

registry! {{
    /// Liu et al. 2023: least squares with dynamic forgetting, then an adaptive extended Kalman filter.
    "dffrls_aekf_robust" => dffrls_aekf_robust::DffrlsAekf,
    /// Baseline of Liu et al. 2023: plain least squares, then an extended Kalman filter.
    "rls_ekf_robust" => rls_ekf_robust::RlsEkf,
    /// Baseline of Liu et al. 2023: one regression with constant forgetting for both.
    "ffrls_robust" => ffrls_robust::Ffrls,
    /// Baseline of Liu et al. 2023: one extended Kalman filter for both.
    "joint_ekf_robust" => joint_ekf_robust::JointEkf,
    /// Curvature by least squares, slope by an adaptive unscented filter on accelerometer and wheel speed.
    "dffrls_aukf_robust" => dffrls_aukf_robust::DffrlsAukf,
    /// The same with fixed noise.
    "dffrls_ukf_robust" => dffrls_ukf_robust::DffrlsUkf,
    /// The adaptive one with an extended filter.
    "dffrls_aekf_inclination_robust" => dffrls_aekf_inclination_robust::DffrlsAekfInclination,
    /// The adaptive one with constant forgetting.
    "ffrls_aukf_robust" => ffrls_aukf_robust::FfrlsAukf,
    /// The adaptive one with multiple forgetting.
    "rls_mff_aukf_robust" => rls_mff_aukf_robust::RlsMffAukf,
    /// Guo et al. 2024: mass from differences, slope by interacting strong-tracking filters.
    "imm_stf_robust" => imm_stf_robust::ImmStf,
    /// The same with fixed transitions between the models.
    "imm_stf_fixed_robust" => imm_stf_fixed_robust::ImmStfFixed,
    /// The same without correction for bends.
    "imm_stf_no_lateral_robust" => imm_stf_no_lateral_robust::ImmStfNoLateral,
    /// The same with plain Kalman filters.
    "imm_ekf_robust" => imm_ekf_robust::ImmEkf,
    /// Plain Kalman filters, fixed transitions.
    "imm_ekf_fixed_robust" => imm_ekf_fixed_robust::ImmEkfFixed,
    /// The kinematic model of `imm_stf_robust` alone.
    "kinematic_stf_robust" => kinematic_stf_robust::KinematicStf,
    /// The dynamic model of `imm_stf_robust` alone.
    "dynamic_stf_robust" => dynamic_stf_robust::DynamicStf,
    /// Patent CN 111507019 B: mass by two weighed models, slope by Sage-Husa and strong tracking in turn.
    "mmrls_sh_stf_robust" => mmrls_sh_stf_robust::MmrlsShStf,
    /// Liu et al. 2023, section 2.2: running resistance of a train of known mass by least squares with dynamic forgetting.
    "resistance_dffrls_robust" => resistance_robust::Resistance,
    /// A regression and a way to forget by choice, then an extended Kalman filter: what can know what.
    "regression_bench" => regression::Regression,
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

/// No train is longer, m.
const MAX_LENGTH_M: Real = 1e3;

fn check(vehicle: &Vehicle) -> Result<(), ParamError> {
    let [low, high] = vehicle.mass_range_kg;
    let positive = |value: Real| value > 0.0 && value.is_finite();
    let span = |[near, far]: [Real; 2]| near <= far && near > -MAX_LENGTH_M && far < MAX_LENGTH_M;
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
        ("imu_arm_m", vehicle.imu_arm_m.abs() < MAX_LENGTH_M),
    ] {
        if !good {
            return Err(ParamError::Vehicle(field));
        }
    }
    vehicle.road.as_ref().map_or(Ok(()), check_road)
}

fn check_road(road: &RoadVehicle) -> Result<(), ParamError> {
    let positive = |value: Real| value > 0.0 && value.is_finite();
    let not_negative = |value: Real| value >= 0.0 && value.is_finite();
    for (field, good) in [
        ("drag_area_m2", not_negative(road.drag_area_m2)),
        ("air_density_kgpm3", not_negative(road.air_density_kgpm3)),
        ("front_axle_m", positive(road.front_axle_m)),
        ("rear_axle_m", positive(road.rear_axle_m)),
        ("front_cornering_npr", positive(road.front_cornering_npr)),
        ("rear_cornering_npr", positive(road.rear_cornering_npr)),
    ] {
        if !good {
            return Err(ParamError::Vehicle(field));
        }
    }
    Ok(())
}

/// No snapshot of any estimator takes more bytes.
pub const MAX_SNAPSHOT_BYTES: usize = 8192;

/// "mono", and the format's version with the size of the scalar.
const FORMAT: [u8; 6] = [b'm', b'o', b'n', b'o', 1, size_of::<Real>() as u8];

/// CRC-32 of ISO 3309: finds every error within 32 bits.
const CHECK: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

impl AnyEstimator {
    /// Writes all it remembers into `bytes`, of which it takes as many as it returns: format, name and settings as fingerprints, state, check
    /// sum. Take one between steps, as often as the memory it goes to bears.
    pub fn snapshot(&self, bytes: &mut [u8]) -> Result<usize, SnapshotError> {
        let mut archive = Archive::writer(bytes);
        archive.raw(FORMAT);
        archive.raw(Fingerprint::of(&self.name()).to_le_bytes());
        archive.raw(self.fingerprint().to_le_bytes());
        let mut copy = *self;
        copy.visit(&mut archive);
        let used = match archive.finish() {
            Ok(used) => used,
            Err(SnapshotError::Room(used)) => return Err(SnapshotError::Room(used + 4)),
            Err(fault) => return Err(fault),
        };
        let room = SnapshotError::Room(used + 4);
        let (body, rest) = bytes.split_at_mut_checked(used).ok_or(room)?;
        let sum = rest.first_chunk_mut().ok_or(room)?;
        *sum = CHECK.checksum(body).to_le_bytes();
        Ok(used + 4)
    }

    /// Becomes what the snapshot tells, to the last bit. Refused, and unchanged, unless the snapshot is whole and of an estimator of this
    /// name, built with the same vehicle and parameters by the same version. The clock must go on from where it was.
    pub fn restore(&mut self, snapshot: &[u8]) -> Result<(), SnapshotError> {
        let (body, sum) = snapshot.split_last_chunk().ok_or(SnapshotError::Torn)?;
        if CHECK.checksum(body).to_le_bytes() != *sum {
            return Err(SnapshotError::Corrupt);
        }
        let mut archive = Archive::reader(body);
        if archive.raw([0; 6]) != FORMAT {
            return Err(SnapshotError::Format);
        }
        if u64::from_le_bytes(archive.raw([0; 8])) != Fingerprint::of(&self.name()) {
            return Err(SnapshotError::OtherEstimator);
        }
        if u64::from_le_bytes(archive.raw([0; 8])) != self.fingerprint() {
            return Err(SnapshotError::OtherSettings);
        }
        let mut restored = *self;
        restored.visit(&mut archive);
        archive.finish()?;
        *self = restored;
        Ok(())
    }
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
