//! Tests of the whole suite, and what all tests of the instruments share: truths of a small train, an Allan deviation.

mod building;
mod faults;
mod noise;
mod physics;
mod seeds;

use super::spec::{InstrumentSpec, InstrumentSpecs};
use super::{Fitting, Suite};
use crate::config::sensor_sheet::Sheet;
use crate::plant::{DriveState, MountState, Truth};
pub use crate::testing::{G, drive_units as train};
use crate::train::Train;
use monorig_estimators::api::signals::{Measurements, Sample};
use nalgebra::{UnitQuaternion, Vector3};

/// Physics step, s.
pub const DT: f64 = 0.002;

/// Allan deviation by its definition: half the mean square of differences of neighbouring averages over m samples.
/// Returns (τ, σ(τ)).
pub fn allan_deviation(x: &[f64], period_s: f64, m: usize) -> (f64, f64) {
    let averages: Vec<f64> = x
        .chunks_exact(m)
        .map(|c| c.iter().sum::<f64>() / m as f64)
        .collect();
    let squares: f64 = averages
        .windows(2)
        .map(|w| (w[1] - w[0]) * (w[1] - w[0]))
        .sum();
    let variance = squares / (2.0 * (averages.len() - 1) as f64);
    (m as f64 * period_s, variance.sqrt())
}

/// Least-squares slope in log-log of points (τ, σ).
pub fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let logs: Vec<(f64, f64)> = points.iter().map(|(a, b)| (a.ln(), b.ln())).collect();
    let (mx, my) = logs
        .iter()
        .fold((0.0, 0.0), |(x, y), (a, b)| (x + a / n, y + b / n));
    let (sxy, sxx) = logs.iter().fold((0.0, 0.0), |(p, q), (a, b)| {
        (p + (a - mx) * (b - my), q + (a - mx) * (a - mx))
    });
    sxy / sxx
}

/// The train standing level at time t.
pub fn standing(train: &Train, t_s: f64) -> Truth {
    let mount = MountState {
        v_w: Vector3::zeros(),
        q_wm: UnitQuaternion::identity(),
        w_w: Vector3::zeros(),
    };
    Truth {
        t_s,
        mounts: vec![mount; train.mounts.len()],
        drives: vec![DriveState::default(); train.drives.len()],
        ..Truth::default()
    }
}

/// The instruments of a sheet in the assets.
pub fn asset(name: &str) -> InstrumentSpecs {
    let file = crate::testing::asset("sensors").join(name);
    Sheet::load(&file).unwrap().specs()
}

/// An instrument of them, to be changed.
pub fn spec<'a>(specs: &'a mut InstrumentSpecs, name: &str) -> &'a mut InstrumentSpec {
    specs.get_mut(name).unwrap()
}

pub fn suite(specs: &InstrumentSpecs, train: &Train, seed: u64) -> Suite {
    Suite::new(specs, &Fitting::new(train, G, seed)).unwrap()
}

/// The train at time t with every mount moved by `change` from standing level.
pub fn moving(train: &Train, t_s: f64, change: impl Fn(&mut MountState)) -> Truth {
    let mut truth = standing(train, t_s);
    truth.mounts.iter_mut().for_each(change);
    truth
}

/// Look at `truth(t)` every `dt` for so many steps, beginning at 0; every result.
pub fn look(
    suite: &mut Suite,
    truth: impl Fn(f64) -> Truth,
    dt: f64,
    steps: usize,
) -> Vec<Measurements> {
    (0..=steps)
        .map(|k| {
            let mut z = Measurements::default();
            suite.measure(&truth(k as f64 * dt), &mut z).unwrap();
            z
        })
        .collect()
}

pub fn forces(seen: &[Measurements]) -> Vec<Sample<[f64; 3]>> {
    seen.iter().filter_map(|z| z.specific_force_mps2).collect()
}

pub fn rates(seen: &[Measurements]) -> Vec<Sample<[f64; 3]>> {
    seen.iter().filter_map(|z| z.angular_rate_radps).collect()
}

pub fn speeds(seen: &[Measurements], unit: usize) -> Vec<Sample<f64>> {
    seen.iter()
        .filter_map(|z| z.wheel_speed_mps[unit])
        .collect()
}

/// Rolling at 1 m/s, working at 50 N·m, clamped at 8 MPa.
pub fn rolling(train: &Train, t_s: f64) -> Truth {
    let mut truth = standing(train, t_s);
    for drive in &mut truth.drives {
        drive.wheel_rate_radps = [1.0 / 0.17; 2];
        drive.motor_torque_nm = 50.0;
        drive.clamp_mpa = 8.0;
    }
    truth
}
