//! The nominal vehicle.

use crate::class::python_class;
use crate::errors::{defect, of_rig, refused};
use monorig_estimators::{Vehicle as Nominal, VehicleData};
use monorig_logs::drive::VehicleFile;
use monorig_sim::closed_loop::Simulation;
use pyo3::prelude::*;
use std::path::PathBuf;

/// The nominal vehicle that estimators are built for.
#[pyclass(frozen, eq, module = "monorig", skip_from_py_object)]
#[derive(Clone, PartialEq)]
pub(crate) struct Vehicle(pub(crate) Nominal);

impl Vehicle {
    fn checked(data: VehicleData) -> PyResult<Self> {
        let help = "use values that the data sheet of a vehicle can have";
        Nominal::new(data).map(Self).map_err(|e| refused(e, help))
    }
}

python_class! {
    Vehicle, self => {
        tare_kg: f64 = self.0.tare_kg;
        drives: usize = self.0.drives;
        wheel_radius_m: f64 = self.0.wheel_radius_m;
        gear_ratio: f64 = self.0.gear_ratio;
        efficiency: f64 = self.0.efficiency;
        rotating_mass_kg: f64 = self.0.rotating_mass_kg;
        running_resistance: f64 = self.0.running_resistance;
        mass_range_kg: (f64, f64) = (self.0.mass_range_kg[0], self.0.mass_range_kg[1]);
        mass_guess_kg: Option<f64> = self.0.mass_guess_kg;
        accel_bias_sd_mps2: Option<f64> = self.0.accel_bias_sd_mps2;
        gyro_bias_sd_radps: Option<f64> = self.0.gyro_bias_sd_radps;
    }
    #[new]
    #[pyo3(signature = (*, tare_kg, wheel_radius_m, mass_range_kg, drives=1, gear_ratio=1.0, efficiency=1.0,
        rotating_mass_kg=0.0, running_resistance=0.0, tare_span_m=[0.0; 2], load_span_m=[0.0; 2], imu_arm_m=0.0,
        accel_bias_sd_mps2=None, gyro_bias_sd_radps=None, mass_guess_kg=None))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        tare_kg: f64,
        wheel_radius_m: f64,
        mass_range_kg: [f64; 2],
        drives: usize,
        gear_ratio: f64,
        efficiency: f64,
        rotating_mass_kg: f64,
        running_resistance: f64,
        tare_span_m: [f64; 2],
        load_span_m: [f64; 2],
        imu_arm_m: f64,
        accel_bias_sd_mps2: Option<f64>,
        gyro_bias_sd_radps: Option<f64>,
        mass_guess_kg: Option<f64>,
    ) -> PyResult<Self> {
        let data = VehicleData {
            tare_kg,
            wheel_radius_m,
            mass_range_kg,
            drives,
            gear_ratio,
            efficiency,
            rotating_mass_kg,
            running_resistance,
            tare_span_m,
            load_span_m,
            imu_arm_m,
            accel_bias_sd_mps2,
            gyro_bias_sd_radps,
            mass_guess_kg,
            ..VehicleData::default()
        };
        let [low, high] = mass_range_kg;
        if low > high {
            let told = format!("mass_range_kg begins at {low} and ends at {high}");
            return Err(refused(told, "the smallest mass first"));
        }
        Self::checked(data)
    }
    /// All of its values, as a file of maps has them.
    fn to_json(&self) -> PyResult<String> {
        serde_json::to_string(&VehicleFile::of(&self.0)).map_err(defect)
    }
    /// The vehicle of these values.
    #[staticmethod]
    fn from_json(text: &str) -> PyResult<Self> {
        let file: Result<VehicleFile, _> = serde_json::from_str(text);
        let data = file.map(|file| file.data());
        let help = "a text that `to_json` of a vehicle has made";
        let data = data.map_err(|e| refused(e, help))?;
        Self::checked(data.ok_or_else(|| refused("its layout is too short", help))?)
    }
    /// The vehicle of a scenario.
    #[staticmethod]
    fn from_scenario(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let built = py.detach(|| Simulation::from_file(path)?.told_exactly().build(1).map(|s| s.vehicle));
        built.map(Self).map_err(of_rig)
    }
    fn __repr__(&self) -> String {
        format!(
            "Vehicle(tare_kg={}, drives={})",
            self.0.tare_kg, self.0.drives
        )
    }
}
