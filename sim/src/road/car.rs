//! A car: its data, the constants of the equations of motion that follow from it, its nominal vehicle.

use super::body::CarModel;
use super::car_file::CarFile;
use super::driver::Driver;
use super::loads::{ChassisGeometry, Suspension};
use super::shapes;
use super::tyre::Tyre;
use super::wheel::WheelSpec;
use crate::config::file::{Sets, read_yaml_with, with_sets};
use crate::config::motor_file::MotorFile;
use crate::error::{DataError, Error};
use crate::train::{Body, Drive, Limits, Mount, Resistance, Train};
use monorig_estimators::api::signals::{RoadVehicle, VehicleData};
use nalgebra::{Isometry3, Matrix3, Vector3};
use std::f64::consts::PI;
use std::path::Path;

/// Specific force for which the data sheet gives the lean, m/s².
const LEAN_GIVEN_AT_MPS2: f64 = 9.81;
/// Mass range for estimators, as shares of the mass; the middle of the range differs from the mass, so that no
/// estimator starts at the truth.
const MASS_RANGE: [f64; 2] = [0.6, 1.6];
/// Largest height of the centre of gravity over half the track width: above it a car tips over before it slides, which
/// is not modelled.
const MAX_HEIGHT_RATIO: f64 = 1.0;

/// A car of checked data.
#[derive(Clone, Debug)]
pub struct Car {
    /// Data sheet of the car.
    pub data: CarFile,
}

impl Car {
    /// Read and check a car file.
    pub fn load(path: &Path) -> Result<Self, Error> {
        Self::load_with(path, &Sets::default())
    }

    /// Loads a car with changes of its file.
    pub(crate) fn load_with(path: &Path, sets: &Sets) -> Result<Self, Error> {
        let file: CarFile = read_yaml_with(path, sets)?;
        Self::new(file).map_err(|e| with_sets(e.in_file(path), sets))
    }
}

impl Car {
    /// Checks the numbers against each other. Keys in errors are those of [`CarFile`].
    pub(crate) fn new(data: CarFile) -> Result<Self, DataError> {
        let (b, w) = (&data.body, &data.wheels);
        let wrong =
            |key: &str, message: String, help: &str| Err(DataError::new(key, message, help));
        let [length, width, height] = b.size_m.map(f64::from);
        let wheelbase = w.front_axle_m.get() + w.rear_axle_m.get();
        if wheelbase >= length {
            return wrong(
                "body.size_m[0]",
                format!("the axles are {wheelbase} m apart, but the car is {length} m long"),
                "a length above wheels.front_axle_m + wheels.rear_axle_m",
            );
        }
        if w.track_width_m.get() > width {
            return wrong(
                "wheels.track_width_m",
                format!("the wheels stand out of a body {width} m wide"),
                "at most the width in body.size_m",
            );
        }
        if b.gravity_height_m.get() > MAX_HEIGHT_RATIO * 0.5 * w.track_width_m.get()
            || b.gravity_height_m.get() >= height
        {
            return wrong(
                "body.gravity_height_m",
                format!(
                    "a car with its centre of gravity at {} m tips over before it slides",
                    b.gravity_height_m.get()
                ),
                "at most half of wheels.track_width_m",
            );
        }
        if data.motors.efficiency.get() == 0.0 {
            return wrong(
                "motors.efficiency",
                "this gear transmits no power".into(),
                "a share above 0, such as 0.97",
            );
        }
        if w.steering_max_deg.get() > 60.0 {
            return wrong(
                "wheels.steering_max_deg",
                format!("front wheels cannot turn by {}°", w.steering_max_deg.get()),
                "at most 60",
            );
        }
        Ok(Self { data })
    }

    /// Constants of the equations of motion under `gravity` (m/s²).
    pub fn model(&self, gravity: f64) -> CarModel {
        let (d, geometry) = (&self.data, self.geometry());
        let [front, rear] = self.axle_loads(gravity);
        let tyre = |cornering: f64, load: f64| Tyre {
            slip_stiffness: d.tyres.slip_stiffness.get(),
            cornering_stiffness: cornering,
            load_loss: d.tyres.load_loss.get(),
            nominal_load_n: 0.5 * load,
            adhesion_along: d.tyres.adhesion_along.get(),
            adhesion_across: d.tyres.adhesion_across.get(),
            relaxation_m: d.tyres.relaxation_m.get(),
        };
        let wheel = |drive: &Drive| WheelSpec {
            radius_m: drive.wheel_radius_m,
            inertia: drive.wheel_inertia
                + 0.5 * drive.gear_ratio * drive.gear_ratio * drive.motor_inertia,
            rolling: d.wheels.rolling_resistance.get(),
        };
        let drives = self.drives();
        let s = &d.suspension;
        let lean = |deg: f64| deg.to_radians() / LEAN_GIVEN_AT_MPS2;
        CarModel {
            geometry,
            suspension: Suspension {
                omega: 2.0 * PI * s.frequency_hz.get(),
                zeta: s.damping.get(),
                pitch_gradient: lean(s.pitch_deg_per_g.get()),
                roll_gradient: lean(s.roll_deg_per_g.get()),
                front_roll_share: s.front_roll_share.get(),
            },
            tyres: [
                tyre(d.tyres.cornering_stiffness_front.get(), front),
                tyre(d.tyres.cornering_stiffness_rear.get(), rear),
            ],
            wheels: drives.map(|drive| wheel(&drive)),
            drives,
            brake_n: {
                let (all, front) = (d.brakes.force_max_n.get(), d.brakes.front_share.get());
                [0.5 * all * front, 0.5 * all * (1.0 - front)]
            },
            brake_lag_s: d.brakes.lag_s.get(),
            drag: 0.5 * d.air.density_kgpm3.get() * self.drag_area_m2(),
            yaw_inertia: d.body.yaw_inertia_kgm2.get(),
            driver: self.driver(gravity),
            gravity,
        }
    }

    /// The car in the form that sensors, recording and viewer use: one rigid body, two driven axles, a place for the
    /// IMU at the centre of gravity.
    pub(crate) fn consist(&self) -> Train {
        let d = &self.data;
        let (w, size) = (&d.wheels, d.body.size_m.map(f64::from));
        let height = d.body.gravity_height_m.get();
        Train {
            name: d.name.clone(),
            bodies: vec![Body {
                name: "car".into(),
                mass_kg: d.body.mass_kg.get(),
                com: Vector3::new(0.0, 0.0, height),
                inertia: Matrix3::identity() * d.body.yaw_inertia_kgm2.get(),
                start_s: -self.nose_m(),
                start_pose: Isometry3::identity(),
                stations: Vec::new(),
                shapes: shapes::shapes(d, self.nose_m()),
            }],
            drives: self.drives().into(),
            mounts: vec![Mount {
                name: "car/imu_link".into(),
                body: 0,
                pose: Isometry3::translation(0.0, 0.0, height),
            }],
            limits: Limits {
                min_radius_horizontal_m: d.limits.min_radius_horizontal_m.get(),
                min_radius_vertical_m: d.limits.min_radius_vertical_m.get(),
                max_grade_rad: d.limits.max_grade_deg.get().to_radians(),
                max_speed_mps: d.limits.max_speed_mps.get(),
                length_m: size[0],
                max_load_kg: 0.0,
            },
            resistance: Resistance {
                running_wheel: w.rolling_resistance.get(),
                air_nspm2: 0.5 * d.air.density_kgpm3.get() * self.drag_area_m2(),
                ..Resistance::default()
            },
            ..Train::default()
        }
    }

    /// Nominal vehicle for the estimators: the car's data sheet, with `tare_kg` in place of its mass if given.
    pub(crate) fn nominal_vehicle(&self, tare_kg: Option<f64>, gravity: f64) -> VehicleData {
        let (d, w) = (&self.data, &self.data.wheels);
        let mass = tare_kg.unwrap_or(d.body.mass_kg.get());
        let [front, rear] = self.cornering(gravity);
        VehicleData {
            tare_kg: mass,
            drives: 2,
            wheel_radius_m: w.radius_m.get(),
            gear_ratio: d.motors.ratio.get(),
            efficiency: d.motors.efficiency.get(),
            rotating_mass_kg: self.rotating_mass_kg(),
            running_resistance: w.rolling_resistance.get(),
            mass_range_kg: MASS_RANGE.map(|share| share * mass),
            mass_guess_kg: None,
            tare_span_m: [0.0; 2],
            load_span_m: [0.0; 2],
            imu_arm_m: 0.0,
            layout: None,
            accel_bias_sd_mps2: None,
            gyro_bias_sd_radps: None,
            road: Some(RoadVehicle {
                drag_area_m2: self.drag_area_m2(),
                air_density_kgpm3: d.air.density_kgpm3.get(),
                front_axle_m: w.front_axle_m.get(),
                rear_axle_m: w.rear_axle_m.get(),
                front_cornering_npr: front,
                rear_cornering_npr: rear,
            }),
        }
    }

    /// Returns the distance from the centre of gravity to the foremost point, m, with equal overhangs.
    pub(crate) fn nose_m(&self) -> f64 {
        let (d, length) = (&self.data, self.data.body.size_m[0].get());
        let g = self.geometry();
        0.5 * (length - g.wheelbase_m()) + d.wheels.front_axle_m.get()
    }

    /// Wheels and rotors reflected to the rim, kg.
    pub fn rotating_mass_kg(&self) -> f64 {
        let (w, m) = (&self.data.wheels, &self.data.motors);
        let ratio = m.ratio.get();
        let rotors = ratio * ratio * (m.front.inertia_kgm2.get() + m.rear.inertia_kgm2.get());
        (4.0 * w.inertia_kgm2.get() + rotors) / (w.radius_m.get() * w.radius_m.get())
    }

    /// Cornering stiffness of the axles at rest on the level, N/rad.
    fn cornering(&self, gravity: f64) -> [f64; 2] {
        let [front, rear] = self.axle_loads(gravity);
        let t = &self.data.tyres;
        [
            t.cornering_stiffness_front.get() * front,
            t.cornering_stiffness_rear.get() * rear,
        ]
    }

    fn axle_loads(&self, gravity: f64) -> [f64; 2] {
        let (g, weight) = (self.geometry(), self.data.body.mass_kg.get() * gravity);
        [g.rear_m, g.front_m].map(|arm| weight * arm / g.wheelbase_m())
    }

    fn drag_area_m2(&self) -> f64 {
        self.data.air.drag_coefficient.get() * self.data.air.frontal_area_m2.get()
    }

    fn geometry(&self) -> ChassisGeometry {
        let (b, w) = (&self.data.body, &self.data.wheels);
        ChassisGeometry {
            mass_kg: b.mass_kg.get(),
            front_m: w.front_axle_m.get(),
            rear_m: w.rear_axle_m.get(),
            track_width_m: w.track_width_m.get(),
            height_m: b.gravity_height_m.get(),
        }
    }

    fn driver(&self, gravity: f64) -> Driver {
        let (d, g) = (&self.data.driver, self.geometry());
        let [front, rear] = self.cornering(gravity);
        let per_wheelbase = g.mass_kg / g.wheelbase_m();
        Driver {
            lookahead_m: d.lookahead_m.get(),
            gain_radpm: d.gain_radpm.get(),
            lag_s: d.lag_s.get(),
            max_angle_rad: self.data.wheels.steering_max_deg.get().to_radians(),
            wheelbase_m: g.wheelbase_m(),
            understeer: per_wheelbase * (g.rear_m / front - g.front_m / rear),
            sideslip: [g.rear_m, per_wheelbase * g.front_m / rear],
        }
    }

    /// Front and rear axle as drive units; values that a car does not have (clamps) are zero.
    fn drives(&self) -> [Drive; 2] {
        let (d, w) = (&self.data, &self.data.wheels);
        let drive = |m: &MotorFile, x: f64| Drive {
            body: 0,
            contact: Vector3::new(x, 0.0, 0.0),
            wheel_radius_m: w.radius_m.get(),
            wheel_inertia: w.inertia_kgm2.get(),
            motor_inertia: m.inertia_kgm2.get(),
            gear_ratio: d.motors.ratio.get(),
            efficiency_drive: d.motors.efficiency.get(),
            efficiency_brake: d.motors.efficiency.get(),
            torque_max_nm: m.torque_max_nm.get(),
            power_w: m.power_kw.get() * 1e3,
            speed_max_radps: m.speed_max_rpm.get() * PI / 30.0,
            lag_s: m.lag_s.get(),
            rate_nmps: m.torque_rate_nmps.get(),
            piston_area_m2: 0.0,
            clamp_mpa: 0.0,
            clamp_lag_s: 0.0,
            adhesion: d.tyres.adhesion_along.get(),
            sigma0: 1.0,
            sigma1: 0.0,
            kappa: 0.0,
            brake_max_n: 0.0,
            brake_lag_s: 0.0,
        };
        [
            drive(&d.motors.front, w.front_axle_m.get()),
            drive(&d.motors.rear, -w.rear_axle_m.get()),
        ]
    }
}
