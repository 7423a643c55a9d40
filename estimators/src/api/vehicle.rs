//! Vehicle data for building an estimator, checked once when they are made.

use core::ops::Deref;

use crate::Real;
use crate::api::fingerprint::Fingerprint;
use crate::api::mass_layout::MassLayout;
use crate::api::params::ParamError;
use crate::api::signals::MAX_DRIVES;

/// Largest length of a train, m.
const MAX_LENGTH_M: Real = 1e3;

/// Speed, m/s, below which a vehicle counts as standing, on a rail and on a road: friction there is not the running
/// resistance, and a road vehicle's wheel speed is less exact.
const STANDSTILL_MPS: [Real; 2] = [0.05, 0.3];

/// A vehicle's nominal values, not yet checked. Fields may be added: end a literal with `..VehicleData::default()`.
///
/// The default has no mass, mass range or wheel radius, which [`Vehicle::new`] refuses; the rest is a point mass of one
/// drive unit without losses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VehicleData {
    /// Mass of the empty train, kg.
    pub tare_kg: Real,
    /// Number of drive units.
    pub drives: usize,
    /// Friction-wheel radius, m.
    pub wheel_radius_m: Real,
    /// Motor revolutions per wheel revolution.
    pub gear_ratio: Real,
    /// Share of motor power that reaches the wheel rim when driving, 0…1.
    pub efficiency: Real,
    /// Rotating masses reflected to the rim, Σ J/r², kg.
    pub rotating_mass_kg: Real,
    /// Running-resistance coefficient, resistance / (total mass · g · cos θ).
    pub running_resistance: Real,
    /// Smallest and largest possible total mass, kg.
    pub mass_range_kg: [Real; 2],
    /// First guess of the total mass, kg; `None`: not told. Estimators start from it.
    pub mass_guess_kg: Option<Real>,
    /// Span of the tare, as distances behind the middle of the unit that carries the IMU (towards falling chainage;
    /// negative = ahead of it), m. Both 0: a point.
    pub tare_span_m: [Real; 2],
    /// Span in which the load's weight acts on the rail, in the same form, m.
    pub load_span_m: [Real; 2],
    /// Distance of the IMU ahead of this middle, m. It pitches with its unit, so it reads the grade under the middle.
    pub imu_arm_m: Real,
    /// Places of the masses by the drawings, for estimators that use more than the spans; `None` if only the spans are
    /// known.
    pub layout: Option<MassLayout>,
    /// Standard deviation of the accelerometer's bias along the train, m/s², with misalignment of its mount times g:
    /// 0.01 of a calibrated IMU, 0.05 to 0.1 of an uncalibrated one, 0.17 for each degree by which its mount is off.
    /// `None`: not known.
    pub accel_bias_sd_mps2: Option<Real>,
    /// Standard deviation of the gyro's biases at switch-on, rad/s: 0.01 to 0.07 of an uncalibrated MEMS. `None`: not
    /// known.
    pub gyro_bias_sd_radps: Option<Real>,
    /// Data that only a road vehicle has; `None` for a train.
    pub road: Option<RoadVehicle>,
}

impl Default for VehicleData {
    fn default() -> Self {
        Self {
            tare_kg: 0.0,
            drives: 1,
            wheel_radius_m: 0.0,
            gear_ratio: 1.0,
            efficiency: 1.0,
            rotating_mass_kg: 0.0,
            running_resistance: 0.0,
            mass_range_kg: [0.0; 2],
            mass_guess_kg: None,
            tare_span_m: [0.0; 2],
            load_span_m: [0.0; 2],
            imu_arm_m: 0.0,
            layout: None,
            accel_bias_sd_mps2: None,
            gyro_bias_sd_radps: None,
            road: None,
        }
    }
}

/// Further data of a road vehicle: drag, and a single-track model for bends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoadVehicle {
    /// Drag coefficient times frontal area, m².
    pub drag_area_m2: Real,
    /// Density of the air, kg/m³.
    pub air_density_kgpm3: Real,
    /// From the centre of gravity forward to the front axle, m.
    pub front_axle_m: Real,
    /// From the centre of gravity back to the rear axle, m.
    pub rear_axle_m: Real,
    /// Cornering stiffness of the front axle (both tyres), N/rad.
    pub front_cornering_npr: Real,
    /// Cornering stiffness of the rear axle (both tyres), N/rad.
    pub rear_cornering_npr: Real,
}

/// Data of the vehicle that an estimator is built with: nominal values, checked to be possible. The truth may differ.
///
/// ```
/// use monorig_estimators::{Vehicle, VehicleData, ParamError};
///
/// let data = VehicleData {
///     tare_kg: 4_000.0,
///     drives: 8,
///     wheel_radius_m: 0.17,
///     gear_ratio: 20.0,
///     efficiency: 0.9,
///     running_resistance: 0.02,
///     mass_range_kg: [4_000.0, 30_000.0],
///     ..VehicleData::default()
/// };
/// let vehicle = Vehicle::new(data)?;
/// assert_eq!(vehicle.tare_kg, 4_000.0);
/// assert_eq!(Vehicle::new(VehicleData { drives: 0, ..data }), Err(ParamError::Vehicle("drives")));
/// # Ok::<(), ParamError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vehicle(VehicleData);

impl Deref for Vehicle {
    type Target = VehicleData;

    fn deref(&self) -> &VehicleData {
        &self.0
    }
}

impl TryFrom<VehicleData> for Vehicle {
    type Error = ParamError;

    fn try_from(data: VehicleData) -> Result<Self, ParamError> {
        Self::new(data)
    }
}

impl Vehicle {
    /// Checks the values; the error names the first impossible field.
    pub fn new(data: VehicleData) -> Result<Self, ParamError> {
        let [low, high] = data.mass_range_kg;
        let span =
            |[near, far]: [Real; 2]| near <= far && near > -MAX_LENGTH_M && far < MAX_LENGTH_M;
        all_good([
            ("tare_kg", positive(data.tare_kg)),
            ("drives", (1..=MAX_DRIVES).contains(&data.drives)),
            ("wheel_radius_m", positive(data.wheel_radius_m)),
            ("gear_ratio", positive(data.gear_ratio)),
            (
                "efficiency",
                positive(data.efficiency) && data.efficiency <= 1.0,
            ),
            ("rotating_mass_kg", not_negative(data.rotating_mass_kg)),
            (
                "running_resistance",
                (0.0..=1.0).contains(&data.running_resistance),
            ),
            (
                "mass_range_kg",
                positive(low) && high > low && high.is_finite(),
            ),
            ("mass_guess_kg", data.mass_guess_kg.is_none_or(positive)),
            ("tare_span_m", span(data.tare_span_m)),
            ("load_span_m", span(data.load_span_m)),
            ("imu_arm_m", data.imu_arm_m.abs() < MAX_LENGTH_M),
            (
                "layout",
                data.layout.is_none_or(|layout| layout.is_possible()),
            ),
            (
                "accel_bias_sd_mps2",
                data.accel_bias_sd_mps2.is_none_or(not_negative),
            ),
            (
                "gyro_bias_sd_radps",
                data.gyro_bias_sd_radps.is_none_or(not_negative),
            ),
        ])?;
        data.road.as_ref().map_or(Ok(()), RoadVehicle::check)?;
        Ok(Self(data))
    }

    /// Values of the vehicle, which can be changed and checked again.
    pub fn data(&self) -> VehicleData {
        self.0
    }

    /// The same as a point: nothing of it before or behind the IMU.
    pub(crate) fn as_point(&self) -> Self {
        Self(VehicleData {
            tare_span_m: [0.0; 2],
            load_span_m: [0.0; 2],
            imu_arm_m: 0.0,
            layout: None,
            ..self.0
        })
    }

    /// The speed below which the vehicle counts as standing, m/s: the one given, or what suits a rail or a road.
    pub fn standstill_mps(&self, given_mps: Option<Real>) -> Real {
        let [rail, road] = STANDSTILL_MPS;
        given_mps.unwrap_or(if self.road.is_some() { road } else { rail })
    }

    /// Returns true if its masses are at one place, so that its effective grade is the grade under that place.
    pub(crate) fn is_point(&self) -> bool {
        self.tare_span_m == [0.0; 2] && self.load_span_m == [0.0; 2]
    }

    /// Standard deviation of the accelerometer's bias, m/s²: the one given, that of the sheet, or `otherwise`.
    pub(crate) fn accel_bias_sd(&self, given_mps2: Option<Real>, otherwise: Real) -> Real {
        given_mps2.or(self.accel_bias_sd_mps2).unwrap_or(otherwise)
    }

    /// Mass at the start, kg: the one given, the vehicle's first guess, or the middle of the mass range; always inside
    /// the range.
    pub fn first_mass_kg(&self, given_kg: Option<Real>) -> Real {
        let [low, high] = self.mass_range_kg;
        let first = given_kg.or(self.mass_guess_kg);
        let first = first.unwrap_or(0.5 * (low + high));
        first.max(low).min(high)
    }

    /// Adds all its values to a fingerprint.
    pub(crate) fn fingerprint(&self, print: &mut Fingerprint) {
        let VehicleData {
            tare_kg,
            drives,
            wheel_radius_m,
            gear_ratio,
            efficiency,
            rotating_mass_kg,
            running_resistance,
            mass_range_kg,
            mass_guess_kg,
            tare_span_m,
            load_span_m,
            imu_arm_m,
            layout,
            accel_bias_sd_mps2,
            gyro_bias_sd_radps,
            road,
        } = self.0;
        print.add(&drives.to_le_bytes());
        let numbers = [
            tare_kg,
            wheel_radius_m,
            gear_ratio,
            efficiency,
            rotating_mass_kg,
            running_resistance,
            imu_arm_m,
        ];
        print.numbers(numbers.iter().chain(&mass_range_kg));
        print.numbers(tare_span_m.iter().chain(&load_span_m));
        if let Some(layout) = layout {
            layout.fingerprint(print);
        }
        // -1: not known.
        let told = [accel_bias_sd_mps2, gyro_bias_sd_radps, mass_guess_kg];
        print.numbers(told.map(|x| x.unwrap_or(-1.0)).iter());
        if let Some(road) = road {
            let RoadVehicle {
                drag_area_m2,
                air_density_kgpm3,
                front_axle_m,
                rear_axle_m,
                front_cornering_npr,
                rear_cornering_npr,
            } = road;
            let numbers = [
                drag_area_m2,
                air_density_kgpm3,
                front_axle_m,
                rear_axle_m,
                front_cornering_npr,
                rear_cornering_npr,
            ];
            print.numbers(&numbers);
        }
    }
}

impl RoadVehicle {
    fn check(&self) -> Result<(), ParamError> {
        all_good([
            ("drag_area_m2", not_negative(self.drag_area_m2)),
            ("air_density_kgpm3", not_negative(self.air_density_kgpm3)),
            ("front_axle_m", positive(self.front_axle_m)),
            ("rear_axle_m", positive(self.rear_axle_m)),
            ("front_cornering_npr", positive(self.front_cornering_npr)),
            ("rear_cornering_npr", positive(self.rear_cornering_npr)),
        ])
    }
}

fn positive(value: Real) -> bool {
    value > 0.0 && value.is_finite()
}

fn not_negative(value: Real) -> bool {
    value >= 0.0 && value.is_finite()
}

fn all_good<const N: usize>(fields: [(&'static str, bool); N]) -> Result<(), ParamError> {
    match fields.iter().find(|(_, good)| !good) {
        Some((field, _)) => Err(ParamError::Vehicle(field)),
        None => Ok(()),
    }
}
