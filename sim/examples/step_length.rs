//! Accuracy that a longer step costs: the loaded train against itself in steps of 0.1 ms.
//!
//!     cargo run --release -p monorig-sim --example step_length -- 2 4 5
//!
//! The steps are in ms, each a whole part of 20: the torque follows the speed every 20 ms, whatever the step. Each
//! figure is the root mean square over the drive of the difference of a value, or of its mean over 20 ms.

use monorig_estimators::api::signals::Command;
use monorig_sim::plant::Plant;
use monorig_sim::rail::Rail;
use monorig_sim::testing::{Cruise, asset_track, train, world};
use nalgebra::{UnitQuaternion, Vector3};
use std::sync::Arc;

const REFERENCE_MS: f64 = 0.1;
const SAMPLE_S: f64 = 20e-3;

/// A drive: track, speed (m/s), when the brake is put on (s), length (s).
type Drive = (&'static str, f64, f64, f64);

const DRIVES: [Drive; 4] = [
    ("liu2023_vehicle_test", 1.0, 80.0, 100.0),
    ("winding", 0.8, 140.0, 150.0),
    ("straight_15deg", 0.8, 66.0, 100.0),
    ("jointed_climb", 1.0, 50.0, 60.0),
];

/// A quantity that is compared.
struct Sample {
    chainage_m: f64,
    speed_mps: f64,
    turns: Vec<UnitQuaternion<f64>>,
    rail_n: Vector3<f64>,
    wheel_load_n: f64,
    imu_mps2: Vector3<f64>,
}

fn drive(rail: &Arc<Rail>, (_, speed, brake_s, seconds): &Drive, step_s: f64) -> Vec<Sample> {
    let train = train("dx80_176y");
    let mut world = world(&train, rail, 20.0, 0.0);
    let mut cruise = Cruise::new(&train, *speed);
    let per_sample = (SAMPLE_S / step_s).round() as usize;
    let imu = monorig_sim::testing::imu(&train);
    let mut samples = Vec::new();
    for k in 0..(seconds / SAMPLE_S) as usize {
        let mut command = cruise.command(&train, &world, SAMPLE_S);
        if k as f64 * SAMPLE_S > *brake_s {
            command = Command {
                motor_torque_nm: Default::default(),
                brake: 1.0,
                ..command
            };
        }
        let before = world.truth().mounts[imu].v_w;
        let (mut rail_n, mut wheel_load_n) = (Vector3::zeros(), 0.0);
        for _ in 0..per_sample {
            world.step(&command, step_s).expect("step");
            rail_n += world.sums().external / per_sample as f64;
            wheel_load_n += world.sums().wheel_load_n / per_sample as f64;
        }
        let t = world.truth();
        samples.push(Sample {
            chainage_m: t.chainage_m,
            speed_mps: t.speed_mps,
            turns: t.poses.iter().map(|p| p.1).collect(),
            rail_n,
            wheel_load_n,
            imu_mps2: (t.mounts[imu].v_w - before) / SAMPLE_S,
        });
    }
    samples
}

/// Root mean square of a difference.
fn rms(a: &[Sample], b: &[Sample], of: impl Fn(&Sample, &Sample) -> f64) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| of(a, b) * of(a, b));
    (squares.sum::<f64>() / a.len() as f64).sqrt()
}

/// Root mean square angle between the turns of all bodies, rad.
fn turned(a: &Sample, b: &Sample) -> f64 {
    let each = a.turns.iter().zip(&b.turns);
    let squares: f64 = each
        .map(|(a, b)| (a.inverse() * b).imag().norm_squared())
        .sum();
    2.0 * (squares / a.turns.len() as f64).sqrt()
}

fn main() {
    let asked: Vec<f64> = std::env::args().filter_map(|a| a.parse().ok()).collect();
    let steps = if asked.is_empty() {
        vec![1.0, 2.0, 3.0]
    } else {
        asked
    };
    println!(
        "drive                 step  chainage     speed  attitude    rail N   wheels N  IMU mm/s²"
    );
    println!(
        "                        ms        mm      mm/s      µrad  of 20 ms   of 20 ms   of 20 ms"
    );
    for d in &DRIVES {
        let rail = asset_track(d.0);
        let exact = drive(&rail, d, 1e-3 * REFERENCE_MS);
        for ms in &steps {
            let seen = drive(&rail, d, 1e-3 * ms);
            println!(
                "{:20} {ms:5} {:9.4} {:9.4} {:9.3} {:9.3} {:10.3} {:10.4}",
                d.0,
                1e3 * rms(&seen, &exact, |a, b| a.chainage_m - b.chainage_m),
                1e3 * rms(&seen, &exact, |a, b| a.speed_mps - b.speed_mps),
                1e6 * rms(&seen, &exact, turned),
                rms(&seen, &exact, |a, b| (a.rail_n - b.rail_n).norm()),
                rms(&seen, &exact, |a, b| a.wheel_load_n - b.wheel_load_n),
                1e3 * rms(&seen, &exact, |a, b| (a.imu_mps2 - b.imu_mps2).norm()),
            );
        }
    }
}
