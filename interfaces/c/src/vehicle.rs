//! The nominal vehicle.

use monorig_estimators::api::mass_layout::{CarriedMass, MAX_MASSES, MassLayout, SuspendedLoad};
use monorig_estimators::api::params::ParamError;
use monorig_estimators::api::signals::{RoadVehicle, Vehicle, VehicleData};

/// A rigid mass: `monorig_carried_mass`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
#[allow(missing_docs)] // the header has them
pub struct Mass {
    pub places_m: [f64; 2],
    pub mass_kg: f64,
    pub depth_m: f64,
}

/// Nominal values of a vehicle: `monorig_vehicle`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)] // the header has them
pub struct NominalVehicle {
    pub size: u64,
    pub drives: u64,
    pub tare_kg: f64,
    pub wheel_radius_m: f64,
    pub gear_ratio: f64,
    pub efficiency: f64,
    pub rotating_mass_kg: f64,
    pub running_resistance: f64,
    pub mass_range_kg: [f64; 2],
    pub mass_guess_kg: f64,
    pub tare_span_m: [f64; 2],
    pub load_span_m: [f64; 2],
    pub imu_arm_m: f64,
    pub accel_bias_sd_mps2: f64,
    pub gyro_bias_sd_radps: f64,
    pub has_layout: u64,
    pub masses: [Mass; MAX_MASSES],
    pub load_places_m: [f64; 2],
    pub swinging_tare_kg: f64,
    pub hook_depth_m: f64,
    pub below_chains_m: f64,
    pub chain_m: f64,
    pub longitudinal_stiffness_npm: f64,
    pub imu_depth_m: f64,
    pub load_share_of_resistance: f64,
    pub has_road: u64,
    pub drag_area_m2: f64,
    pub air_density_kgpm3: f64,
    pub front_axle_m: f64,
    pub rear_axle_m: f64,
    pub front_cornering_npr: f64,
    pub rear_cornering_npr: f64,
}

/// NaN stands for an unknown value.
fn known(x: f64) -> Option<f64> {
    (!x.is_nan()).then_some(x)
}

/// A struct with fields that other structs have under the same names, followed by its own fields.
macro_rules! gathered {
    ($to:ident: $($from:ident { $($field:ident),+ })+; $($own:tt)*) => {
        $to { $($($field: $from.$field,)+)+ $($own)* }
    };
}

impl From<&Vehicle> for NominalVehicle {
    fn from(v: &Vehicle) -> Self {
        let layout = v.layout.unwrap_or_default();
        let load = layout.load;
        let none = RoadVehicle {
            drag_area_m2: 0.0,
            air_density_kgpm3: 0.0,
            front_axle_m: 0.0,
            rear_axle_m: 0.0,
            front_cornering_npr: 0.0,
            rear_cornering_npr: 0.0,
        };
        let road = v.road.unwrap_or(none);
        gathered!(Self:
            v {
                tare_kg, wheel_radius_m, gear_ratio, efficiency, rotating_mass_kg, running_resistance, mass_range_kg,
                tare_span_m, load_span_m, imu_arm_m
            }
            load { swinging_tare_kg, hook_depth_m, below_chains_m, chain_m }
            layout { imu_depth_m, load_share_of_resistance }
            road { drag_area_m2, air_density_kgpm3, front_axle_m, rear_axle_m, front_cornering_npr, rear_cornering_npr };
            size: size_of::<Self>() as u64,
            drives: v.drives as u64,
            mass_guess_kg: v.mass_guess_kg.unwrap_or(f64::NAN),
            accel_bias_sd_mps2: v.accel_bias_sd_mps2.unwrap_or(f64::NAN),
            gyro_bias_sd_radps: v.gyro_bias_sd_radps.unwrap_or(f64::NAN),
            has_layout: v.layout.is_some().into(),
            masses: layout.masses.map(|m| gathered!(Mass: m { places_m, mass_kg, depth_m };)),
            load_places_m: load.places_m,
            longitudinal_stiffness_npm: load.longitudinal_stiffness_npm.unwrap_or(f64::NAN),
            has_road: v.road.is_some().into(),
        )
    }
}

impl TryFrom<&NominalVehicle> for Vehicle {
    type Error = ParamError;

    fn try_from(v: &NominalVehicle) -> Result<Self, ParamError> {
        let load = gathered!(SuspendedLoad:
            v { swinging_tare_kg, hook_depth_m, below_chains_m, chain_m };
            places_m: v.load_places_m,
            longitudinal_stiffness_npm: known(v.longitudinal_stiffness_npm),
        );
        let layout = gathered!(MassLayout:
            v { imu_depth_m, load_share_of_resistance };
            masses: v.masses.map(|m| gathered!(CarriedMass: m { places_m, mass_kg, depth_m };)),
            load,
        );
        let road = gathered!(RoadVehicle:
            v { drag_area_m2, air_density_kgpm3, front_axle_m, rear_axle_m, front_cornering_npr, rear_cornering_npr };
        );
        Vehicle::new(gathered!(VehicleData:
            v {
                tare_kg, wheel_radius_m, gear_ratio, efficiency, rotating_mass_kg, running_resistance, mass_range_kg,
                tare_span_m, load_span_m, imu_arm_m
            };
            drives: usize::try_from(v.drives).unwrap_or(usize::MAX),
            mass_guess_kg: known(v.mass_guess_kg),
            layout: (v.has_layout != 0).then_some(layout),
            accel_bias_sd_mps2: known(v.accel_bias_sd_mps2),
            gyro_bias_sd_radps: known(v.gyro_bias_sd_radps),
            road: (v.has_road != 0).then_some(road),
        ))
    }
}
