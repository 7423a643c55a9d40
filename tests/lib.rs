//! What the tests of the whole simulator share: worlds of the trains and tracks of `monorig_sim::testing`, and a cruise control.

use monorig_estimators::api::signals::{Command, MAX_DRIVES};
use monorig_sim::plant::Plant;
use monorig_sim::plant::PlantOptions;
use monorig_sim::plant::rapier::World;
use monorig_sim::rail::Rail;
use monorig_sim::train::Train;
use std::sync::Arc;

pub use monorig_sim::testing::{G, asset, asset_track, car, road, scenario, slope, track, train};

pub fn imu(train: &Train) -> usize {
    train
        .mounts
        .iter()
        .position(|m| m.name.ends_with("/imu_link"))
        .expect("imu mount")
}

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

pub fn run(w: &mut World, c: &Command, seconds: f64, dt: f64) {
    for _ in 0..(seconds / dt).round() as usize {
        w.step(c, dt).expect("step");
    }
}

/// A PI speed controller of the test's own: torque for each motor.
pub struct Cruise {
    pub speed: f64,
    pub integral: f64,
    pub torque_max: f64,
    pub gain: f64,
}

impl Cruise {
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

    pub fn command(&mut self, train: &Train, w: &World, dt: f64) -> Command {
        let e = self.speed - w.truth().speed_mps;
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
