//! A file of nominal values: all numbers of a vehicle that estimators are given, where no train or car file is at hand.

use monorig_estimators::api::mass_layout::MassLayout;
use monorig_estimators::api::signals::{RoadVehicle, VehicleData};
use monorig_sim::config::checked::Version1;
use monorig_sim::config::file::Document;
use monorig_sim::error::Error;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Key by which the file is recognised.
const KEY: &str = "nominal_vehicle";

/// A file of nominal values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VehicleFile {
    /// Format version, 1.
    version: Version1,
    /// The values.
    nominal_vehicle: NominalValues,
}

/// Nominal values of a vehicle for the estimators.
#[serde_with::skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct NominalValues {
    /// Mass of the empty vehicle, kg.
    tare_kg: f64,
    /// Number of drive units.
    drives: usize,
    /// Radius of the driven wheels, m.
    wheel_radius_m: f64,
    /// Motor revolutions per wheel revolution.
    gear_ratio: f64,
    /// Share of motor power that reaches the wheel rim.
    efficiency: f64,
    /// Rotating masses reflected to the rim, kg.
    rotating_mass_kg: f64,
    /// Running-resistance coefficient.
    running_resistance: f64,
    /// Smallest and largest possible total mass, kg.
    mass_range_kg: [f64; 2],
    /// First guess of the total mass, kg; none = not given.
    mass_guess_kg: Option<f64>,
    /// From where to where behind the middle of the unit with the IMU the tare is spread, m; both 0 = a point.
    #[serde(default)]
    tare_span_m: [f64; 2],
    /// Span in which the load's weight acts on the rail, in the same form, m.
    #[serde(default)]
    load_span_m: [f64; 2],
    /// Distance of the IMU ahead of this middle, m.
    #[serde(default)]
    imu_arm_m: f64,
    /// Places of the masses, as the numbers of `MassLayout::numbers` in their order: four a mass (front and rear place,
    /// kg, depth), then those of the load.
    layout: Option<Vec<f64>>,
    /// Standard deviation of the accelerometer's bias, m/s²; none = not known.
    accel_bias_sd_mps2: Option<f64>,
    /// Standard deviation of the gyro's bias, rad/s; none = not known.
    gyro_bias_sd_radps: Option<f64>,
    /// Values that only a road vehicle has.
    road: Option<RoadValues>,
}

/// Values that only a road vehicle has.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RoadValues {
    /// Drag coefficient times frontal area, m².
    drag_area_m2: f64,
    /// Density of the air, kg/m³.
    air_density_kgpm3: f64,
    /// From the centre of gravity forward to the front axle, m.
    front_axle_m: f64,
    /// From the centre of gravity back to the rear axle, m.
    rear_axle_m: f64,
    /// Cornering stiffness of the front axle, N/rad.
    front_cornering_npr: f64,
    /// Cornering stiffness of the rear axle, N/rad.
    rear_cornering_npr: f64,
}

/// A struct with fields that another struct has under the same names, and then fields of its own.
macro_rules! gathered {
    ($to:ident { $from:ident: $($field:ident),+; $($own:tt)* }) => {
        $to { $($field: $from.$field,)+ $($own)* }
    };
}

/// The values of a vehicle in `$to`, which have one name in a file and in the estimators.
macro_rules! vehicle_values {
    ($to:ident { $from:ident; $($own:tt)* }) => {
        gathered!($to {
            $from: tare_kg, drives, wheel_radius_m, gear_ratio, efficiency, rotating_mass_kg, running_resistance,
                mass_range_kg, mass_guess_kg, tare_span_m, load_span_m, imu_arm_m, accel_bias_sd_mps2, gyro_bias_sd_radps;
            $($own)*
        })
    };
}

/// The values of a road vehicle in `$to`.
macro_rules! road_values {
    ($to:ident { $from:ident }) => {
        gathered!($to {
            $from: drag_area_m2, air_density_kgpm3, front_axle_m, rear_axle_m, front_cornering_npr, rear_cornering_npr;
        })
    };
}

/// The values of a file; none of a file of another kind.
pub(super) fn read(path: &Path) -> Result<Option<VehicleData>, Error> {
    let document = Document::read(path)?;
    if !document.keys().iter().any(|key| key == KEY) {
        return Ok(None);
    }
    VehicleFile::values(&document).map(Some)
}

impl VehicleFile {
    /// The values that a document holds, not yet checked.
    pub fn values(document: &Document) -> Result<VehicleData, Error> {
        let file: Self = document.parse()?;
        file.data().ok_or_else(|| {
            document.error(
                format!("{KEY}.layout"),
                "a mass layout needs more numbers",
                "give all numbers, as `monorig log export` writes them, or no layout",
            )
        })
    }

    /// The file of these values.
    pub fn of(v: &VehicleData) -> Self {
        Self {
            version: Version1,
            nominal_vehicle: vehicle_values!(NominalValues {
                v;
                layout: v.layout.map(|layout| layout.numbers().collect()),
                road: v.road.map(|r| road_values!(RoadValues { r })),
            }),
        }
    }

    /// The values, not yet checked; none if the layout has too few numbers.
    pub fn data(&self) -> Option<VehicleData> {
        let v = &self.nominal_vehicle;
        let layout = match &v.layout {
            None => None,
            Some(numbers) => {
                let mut numbers = numbers.iter().copied();
                Some(MassLayout::from_numbers(|| numbers.next())?)
            }
        };
        Some(vehicle_values!(VehicleData {
            v;
            layout,
            road: v.road.as_ref().map(|r| road_values!(RoadVehicle { r })),
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A vehicle is read back as it was written, every bit, also of numbers that no decimal fraction has.
    #[test]
    fn a_vehicle_survives_its_file() {
        let layout = MassLayout::even(9_000.0 / 7.0, [-2.0 / 3.0, 14.1], [5.0, 8.0]);
        let road = RoadVehicle {
            drag_area_m2: 0.1 + 0.2,
            air_density_kgpm3: 1.2,
            front_axle_m: 1.0 / 3.0,
            rear_axle_m: 1.5,
            front_cornering_npr: 1e5 / 3.0,
            rear_cornering_npr: 9e4,
        };
        let data = VehicleData {
            tare_kg: 1e4 / 3.0,
            drives: 8,
            wheel_radius_m: 0.17,
            running_resistance: 1e-3 / 7.0,
            mass_range_kg: [1e3, 1e5 / 3.0],
            layout: Some(layout),
            gyro_bias_sd_radps: Some(1e-7 / 3.0),
            road: Some(road),
            ..VehicleData::default()
        };
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("vehicle.yaml");
        let text = serde_json::to_string(&VehicleFile::of(&data)).unwrap();
        std::fs::write(&path, text).unwrap();
        assert_eq!(read(&path).unwrap(), Some(data));
        std::fs::write(&path, "consist: []").unwrap();
        assert_eq!(read(&path).unwrap(), None);
    }
}
