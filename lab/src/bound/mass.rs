//! Bound of the mass: motor torque and acceleration, the slope known to the noise of the accelerometer.

use super::sheet::SheetNoise;
use monorig_estimators::api::signals::Vehicle;
use monorig_estimators::api::tolerances::{TOLERANCES, Tolerances};
use monorig_sim::plant::Truth;
use nalgebra::{SMatrix, SVector};

type MassCovariance = SMatrix<f64, STATES, STATES>;
type MassRow = SVector<f64, STATES>;

/// Mass, constant resistance, resistance by speed, resistance in bends, grade of the rail behind the train at the
/// start.
const STATES: usize = 5;
const MASS: usize = 0;
const UNSEEN: usize = 4;
/// Time over which means are one measurement, s.
const BLOCK_S: f64 = 0.1;
/// Speed below which the resistance is static friction, m/s.
const MOVES_MPS: f64 = 0.06;
/// Priors: of the resistance's growth with the speed, N·s/m; with the curvature of a bend, N·m; of the grade of the
/// rail behind, rad, over so many metres.
const BY_SPEED: f64 = 60.0;
const BY_CURVATURE: f64 = 10e3;
const BEHIND: (f64, f64) = (0.02, 9.0);

/// Sums over a block of a drive, for its means.
#[derive(Clone, Debug, Default)]
struct DriveBlock {
    samples: f64,
    speed: f64,
    accel: f64,
    sine: f64,
    cosine: f64,
    curvature: f64,
    torques: Vec<f64>,
}

/// Kalman covariance of the force balance, linearised at the true motion:
///
/// ```text
/// F = M (a + g sin θ_e) + s (r + c |v| + q |κ|) + η g U/9 m,   noise of F: torques, and M times that of the accelerometer
/// ```
///
/// U: moment of the masses that still stand on the rail behind the start.
pub(crate) struct MassBound {
    noise: SheetNoise,
    /// Standard deviation of gears and wheels, a share of the force.
    drive_sd: f64,
    covariance: Option<MassCovariance>,
    mass_kg: f64,
    start_m: f64,
    block: DriveBlock,
    ends_s: f64,
    /// Standard deviation of the effective grade by the rail behind the start, rad.
    unseen_rad: f64,
}

impl MassBound {
    /// Makes the bound for instruments with this noise, and nominal values with these tolerances.
    pub(crate) fn new(noise: SheetNoise, tolerances: &Tolerances) -> Self {
        Self {
            noise,
            drive_sd: tolerances.efficiency.hypot(tolerances.wheel_radius),
            covariance: None,
            mass_kg: f64::NAN,
            start_m: 0.0,
            block: DriveBlock::default(),
            ends_s: BLOCK_S,
            unseen_rad: 0.0,
        }
    }

    /// Called after each step of the plant.
    pub(crate) fn step(&mut self, truth: &Truth, vehicle: &Vehicle, gravity: f64) {
        if self.mass_kg.is_nan() {
            self.start_m = truth.chainage_m;
        }
        if self.mass_kg != truth.total_mass_kg {
            self.load_changed(truth.total_mass_kg, vehicle, gravity);
        }
        let block = &mut self.block;
        block.samples += 1.0;
        block.speed += truth.speed_mps;
        block.accel += truth.accel_mps2;
        block.sine += libm::sin(truth.grade_effective_rad);
        block.cosine += libm::cos(truth.grade_effective_rad);
        block.curvature += truth.curvature_horizontal_1pm.abs();
        block.torques.resize(truth.drives.len(), 0.0);
        for (sum, drive) in block.torques.iter_mut().zip(&truth.drives) {
            *sum += drive.motor_torque_nm;
        }
        if truth.t_s + 1e-9 >= self.ends_s {
            self.ends_s += BLOCK_S;
            let block = std::mem::take(&mut self.block);
            self.balance(&block, truth.chainage_m - self.start_m, vehicle, gravity);
        }
    }

    /// Resets the knowledge of the load to the vehicle's range; other knowledge stays.
    fn load_changed(&mut self, mass_kg: f64, vehicle: &Vehicle, gravity: f64) {
        self.mass_kg = mass_kg;
        let [low, high] = vehicle.mass_range_kg;
        let prior = (high - low) / 12f64.sqrt();
        let p = self.covariance.get_or_insert_with(|| {
            let resistance =
                TOLERANCES.running_resistance * vehicle.running_resistance * mass_kg * gravity;
            let sds = [prior, resistance, BY_SPEED, BY_CURVATURE, BEHIND.0];
            MassCovariance::from_diagonal(&MassRow::from(sds.map(|sd| sd * sd)))
        });
        p.row_mut(MASS).fill(0.0);
        p.column_mut(MASS).fill(0.0);
        p[(MASS, MASS)] = prior * prior;
    }

    fn balance(&mut self, block: &DriveBlock, way_m: f64, vehicle: &Vehicle, gravity: f64) {
        let (Some(p), Some(torque), Some(accelerometer)) = (
            self.covariance.as_mut(),
            self.noise.motor_torque,
            self.noise.accelerometer,
        ) else {
            return;
        };
        let n = block.samples.max(1.0);
        let speed = block.speed / n;
        let moment = behind(vehicle, self.mass_kg, way_m);
        if speed.abs() > MOVES_MPS {
            let sign = speed.signum();
            let share = vehicle.layout.map_or(1.0, |l| l.load_share_of_resistance);
            let rolling = share * vehicle.running_resistance * gravity * sign * block.cosine / n;
            let h = MassRow::from([
                block.accel / n + gravity * block.sine / n + rolling,
                sign,
                sign * speed.abs(),
                sign * block.curvature / n,
                gravity * moment / BEHIND.1,
            ]);
            let per_torque = vehicle.gear_ratio * vehicle.efficiency / vehicle.wheel_radius_m;
            let of_torques: f64 = block
                .torques
                .iter()
                .map(|t| {
                    let relative = torque.white_rel * t / n;
                    relative * relative + torque.white_sd * torque.white_sd
                })
                .sum();
            let by_torque =
                of_torques * per_torque * per_torque / (torque.rate_hz * BLOCK_S).max(1.0);
            let inertia = self.mass_kg * accelerometer.white_sd;
            let by_inertia = inertia * inertia / (accelerometer.rate_hz * BLOCK_S).max(1.0);
            let ph = *p * h;
            let s = h.dot(&ph) + by_torque + by_inertia;
            *p -= ph * ph.transpose() / s;
        }
        self.unseen_rad = p[(UNSEEN, UNSEEN)].sqrt() * moment / (BEHIND.1 * self.mass_kg);
    }

    /// Standard deviation of the mass as a share of the mass, including the scale of torque sensors, gears and wheels,
    /// which cannot be separated from mass; and of the effective grade from the rail behind the train, rad.
    pub(crate) fn sd(&self, drives: usize) -> Option<(f64, f64)> {
        let p = self.covariance?;
        let gain = self.noise.motor_torque?.scale_sd / (drives.max(1) as f64).sqrt();
        Some((
            (p[(MASS, MASS)].sqrt() / self.mass_kg)
                .hypot(gain)
                .hypot(self.drive_sd),
            self.unseen_rad,
        ))
    }
}

/// Σ m·(how far m is behind where the IMU's unit began), kg·m: what is on rail that no instrument has been over.
fn behind(vehicle: &Vehicle, mass_kg: f64, way_m: f64) -> f64 {
    let Some(layout) = vehicle.layout else {
        return 0.0;
    };
    let of = |places: [f64; 2], kg: f64| {
        let sum: f64 = places.iter().map(|x| (x - way_m.max(0.0)).max(0.0)).sum();
        0.5 * kg * sum
    };
    let load = mass_kg - vehicle.tare_kg + layout.load.swinging_tare_kg;
    let tare: f64 = layout
        .masses
        .iter()
        .map(|m| of(m.places_m, m.mass_kg))
        .sum();
    tare + of(layout.load.places_m, load.max(0.0))
}
