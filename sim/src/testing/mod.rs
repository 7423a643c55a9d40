//! Vehicles, tracks and scenarios for tests: those of this crate, and with the feature `testing` those of other crates.
//!
//! Panics where something is wrong, as tests do.
#![allow(clippy::unwrap_used, clippy::expect_used)]

pub mod modes;

use crate::config::scenario::Scenario;
use crate::config::track::TrackFile;
use crate::plant::rapier::World;
use crate::plant::{Plant, PlantOptions};
use crate::rail::Rail;
use crate::rail::profile::Profile;
use crate::road::Car;
use crate::train::{Drive, Mount, Train};
use monorig_estimators::api::signals::{Command, MAX_DRIVES, Vehicle, VehicleData};
use nalgebra::{Isometry3, Vector3};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Gravity in the tests, m/s².
pub const G: f64 = 9.81;

/// A file of the repository's `assets/`, such as `rails/i140e.yaml`.
pub fn asset(name: &str) -> PathBuf {
    repository().join("assets").join(name)
}

/// A scenario of the repository, with values set as by `--set`.
pub fn scenario(name: &str, set: &[(&str, &str)]) -> Scenario {
    let path = repository().join("scenarios").join(format!("{name}.yaml"));
    let set = set.iter().map(|(a, b)| (a.to_string(), b.to_string()));
    Scenario::load(&path, &set.collect::<Vec<_>>()).expect("scenario")
}

/// A train of the repository, such as `dx80_176y`.
pub fn train(name: &str) -> Train {
    Train::load(&asset(&format!("trains/{name}.yaml"))).expect("train")
}

/// The car of the repository.
pub fn car() -> Car {
    Car::load(&asset("road/hongqi_ehs3.yaml")).expect("car")
}

/// A track of the repository, such as `winding`.
pub fn asset_track(name: &str) -> Arc<Rail> {
    Arc::new(Rail::load(&asset(&format!("tracks/{name}.yaml"))).expect("track"))
}

/// The rail profile of the repository.
pub fn profile() -> Profile {
    Profile::load(&asset("rails/i140e.yaml")).expect("profile")
}

/// A track from the YAML lines that follow its name.
pub fn track(yaml: &str) -> Arc<Rail> {
    Arc::new(try_track(yaml).expect("rail"))
}

/// The same for a track that may have mistakes; errors name `test.yaml`.
pub fn try_track(yaml: &str) -> Result<Rail, crate::error::Error> {
    let file = track_file(&format!("profile: none\n{yaml}"));
    Rail::build(&file, profile(), Path::new("test.yaml"))
}

/// A road 4 m wide from the YAML lines that follow its width.
pub fn road(yaml: &str) -> Arc<Rail> {
    let file = track_file(&format!("road_width_m: 4\n{yaml}"));
    Arc::new(Rail::read(&file, Path::new("test.yaml")).expect("road"))
}

/// A straight track of constant grade, degrees, 400 m long.
pub fn slope(deg: f64) -> Arc<Rail> {
    track(&format!(
        "vertical: [{{kind: grade, grade_deg: {deg}, length_m: 400}}]\n"
    ))
}

/// A train of so many drive units `drive_1`, `drive_2`, …, each with links `frame` and `imu_link`; it has no bodies.
pub fn drive_units(count: usize) -> Train {
    let links = |i| ["frame", "imu_link"].map(|link| format!("drive_{i}/{link}"));
    let mount = |name| Mount {
        name,
        body: 0,
        pose: Isometry3::identity(),
    };
    Train {
        name: "test".into(),
        drives: vec![drive(); count],
        mounts: (1..=count).flat_map(links).map(mount).collect(),
        ..Train::default()
    }
}

/// A drive unit much like that of the DX80.
pub fn drive() -> Drive {
    Drive {
        body: 0,
        contact: Vector3::zeros(),
        wheel_radius_m: 0.17,
        wheel_inertia: 2.0,
        motor_inertia: 0.1,
        gear_ratio: 19.3,
        efficiency_drive: 0.95,
        efficiency_brake: 0.95,
        torque_max_nm: 100.0,
        power_w: 7500.0,
        speed_max_radps: 272.0,
        lag_s: 0.05,
        rate_nmps: 1e3,
        piston_area_m2: 0.003,
        clamp_mpa: 10.0,
        clamp_lag_s: 0.2,
        adhesion: 0.3,
        sigma0: 1.2e7,
        sigma1: 2e4,
        kappa: 1e-3,
        brake_max_n: 2e4,
        brake_lag_s: 0.2,
    }
}

/// Nominal vehicle of a train of 9 t with eight drive units, for estimators and controllers.
pub fn vehicle() -> Vehicle {
    Vehicle::new(VehicleData {
        tare_kg: 9000.0,
        drives: 8,
        wheel_radius_m: 0.17,
        gear_ratio: 19.0,
        efficiency: 0.95,
        rotating_mass_kg: 1300.0,
        running_resistance: 0.02,
        mass_range_kg: [5e3, 4e4],
        ..VehicleData::default()
    })
    .expect("vehicle")
}

/// The IMU of a train: its first mount of that name.
pub fn imu(train: &Train) -> usize {
    train
        .mounts
        .iter()
        .position(|m| m.name.ends_with("/imu_link"))
        .expect("imu mount")
}

/// A start with the front at a chainage (m) and a speed (m/s), with the IMU as the only mount.
pub fn options(train: &Train, front_m: f64, speed_mps: f64) -> PlantOptions {
    let imu = imu(train);
    PlantOptions {
        front_m,
        speed_mps,
        gravity_mps2: G,
        imu,
        mounts: vec![imu],
        ..PlantOptions::default()
    }
}

/// A train in rapier, as [`options`] start it.
pub fn world(train: &Train, rail: &Arc<Rail>, front_m: f64, speed_mps: f64) -> World {
    World::new(
        train.clone(),
        rail.clone(),
        &options(train, front_m, speed_mps),
    )
    .expect("world")
}

/// All motors at the same torque, clamps at their nominal pressure.
pub fn torque(train: &Train, nm: f64) -> Command {
    Command {
        motor_torque_nm: [nm; MAX_DRIVES],
        clamp_pressure_mpa: train.drives[0].clamp_mpa,
        brake: 0.0,
    }
}

/// Steps of `dt` (s) under one command.
pub fn run(w: &mut World, c: &Command, seconds: f64, dt: f64) {
    for _ in 0..(seconds / dt).round() as usize {
        w.step(c, dt).expect("step");
    }
}

/// A PI speed controller only for tests: torque for each motor.
pub struct Cruise {
    /// Speed to hold, m/s.
    pub speed: f64,
    /// Integral of the speed error, m.
    pub integral: f64,
    /// Largest torque of a motor, N·m.
    pub torque_max: f64,
    /// Torque per acceleration, N·m·s²/m.
    pub gain: f64,
}

impl Cruise {
    /// For a train and a speed, m/s.
    pub fn new(train: &Train, speed: f64) -> Self {
        let d = &train.drives[0];
        let total: f64 = train.bodies.iter().map(|b| b.mass_kg).sum();
        let gain = total * d.wheel_radius_m / (d.gear_ratio * train.drives.len() as f64);
        Self {
            speed,
            integral: 0.0,
            torque_max: d.torque_max_nm,
            gain,
        }
    }

    /// The command of a step of `dt` (s).
    pub fn command(&mut self, train: &Train, w: &World, dt: f64) -> Command {
        self.command_at(train, w.truth().speed_mps, dt)
    }

    /// The same for a train at a speed, m/s.
    pub fn command_at(&mut self, train: &Train, speed_mps: f64, dt: f64) -> Command {
        let e = self.speed - speed_mps;
        self.integral += e * dt;
        let t = self.gain * (2.0 * e + 0.8 * self.integral);
        // Downhill the motors alone may not hold the train: the brake takes what is too fast.
        let brake = ((-e - 0.05) / 0.5).clamp(0.0, 1.0);
        Command {
            brake,
            ..torque(train, t.clamp(-self.torque_max, self.torque_max))
        }
    }
}

fn track_file(yaml: &str) -> TrackFile {
    serde_yaml::from_str(&format!("version: 1\nname: test\n{yaml}")).expect("track")
}

fn repository() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}
