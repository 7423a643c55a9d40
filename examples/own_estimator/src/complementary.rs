//! Slope by a complementary filter on accelerometer, gyro and wheels; mass by recursive least squares on the force
//! balance.

use monorig_estimators::{
    Command, Error, Estimate, Estimator, Internal, Measurements, Real, Value, Vehicle, params,
};
use std::collections::VecDeque;
use std::f64::consts::TAU;

const G: Real = 9.81;
/// Friction at standstill is not the running resistance, m/s.
const MIN_SPEED_MPS: Real = 0.1;
/// Standard deviation of the grade of the whole train where only that under the IMU is known, rad.
const GRADE_ALONG_TRAIN_SD_RAD: Real = 0.06;

params! {
    /// Parameters of [`Complementary`].
    ComplementaryParams {
        crossover_hz ["Hz"] = 0.15, 0.005 => 2.0, "Below it the slope follows accelerometer and wheels, above it the gyro.";
        forgetting ["-"] = 0.9998, 0.99 => 1.0, "Forgetting factor of the mass regression, per step.";
        window ["-"] = 40.0, 1.0 => 1000.0, "Forces and accelerations are averaged over so many steps.";
        gyro [flag] = true, "Use the gyro; without it the slope lags.";
    }
}

/// The estimator. It may allocate: here a window of past values on the heap.
pub struct Complementary {
    vehicle: Vehicle,
    params: ComplementaryParams,
    last: Measurements,
    speed_mps: Real,
    grade_rad: Real,
    mass_kg: Real,
    /// Variance of the mass, kg².
    variance: Real,
    /// Mean square of the regression's residuals, N².
    residual2: Real,
    /// Force on the train (N), and the acceleration that its mass answers with (m/s²).
    window: VecDeque<[Real; 2]>,
}

impl Complementary {
    /// For a vehicle, from the middle of its mass range.
    pub fn new(vehicle: &Vehicle, params: &ComplementaryParams) -> Self {
        let [low, high] = vehicle.mass_range_kg;
        Self {
            vehicle: *vehicle,
            params: *params,
            last: Measurements::default(),
            speed_mps: 0.0,
            grade_rad: 0.0,
            mass_kg: 0.5 * (low + high),
            variance: (high - low).powi(2) / 12.0,
            residual2: 1e6,
            window: VecDeque::new(),
        }
    }

    /// Observer of speed and grade with two poles at the crossover: v' = f − g sin θ + 1.4 ω e, θ' = −ω_y − ω²/g e.
    /// Returns v'.
    fn follow_grade(&mut self, f: Real, error: Real, dt: Real) -> Real {
        let gyro = self.last.angular_rate_radps.filter(|_| self.params.gyro);
        let rate = gyro.map_or(0.0, |s| -s.value[1]);
        let omega = TAU * self.params.crossover_hz;
        let acceleration = f - G * self.grade_rad.sin();
        self.speed_mps += dt * (acceleration + 1.4 * omega * error);
        self.grade_rad += dt * (rate - omega * omega / G * error);
        self.grade_rad = self.grade_rad.clamp(-0.7, 0.7);
        acceleration
    }

    /// Recursive least squares on averages of F − m_rot v' = m (f + c g cos θ).
    fn learn_mass(&mut self, f: Real, acceleration: Real) {
        let v = &self.vehicle;
        let torques = self.last.motor_torque_nm.iter().flatten();
        let rim = torques.map(|s| s.value).sum::<Real>() * v.gear_ratio / v.wheel_radius_m;
        // losses take from the force that drives, and help that which brakes
        let force = rim * v.efficiency.powf(rim.signum()) - v.rotating_mass_kg * acceleration;
        let resisting = v.running_resistance * G * self.grade_rad.cos();
        self.window.push_back([force, f + resisting]);
        while self.window.len() as Real > self.params.window {
            self.window.pop_front();
        }
        let n = self.window.len() as Real;
        let mean = |i: usize| self.window.iter().map(|w| w[i]).sum::<Real>() / n;
        let (y, h, [low, high]) = (mean(0), mean(1), v.mass_range_kg);
        let residual = y - h * self.mass_kg;
        // averages over n steps overlap: n of them say what one says
        let noise = n * self.residual2;
        let gain = self.variance * h / (h * self.variance * h + noise);
        self.mass_kg = (self.mass_kg + gain * residual).clamp(low, high);
        let variance = (1.0 - gain * h) * self.variance / self.params.forgetting;
        self.variance = variance.min((high - low).powi(2));
        self.residual2 += 1e-3 * (residual * residual - self.residual2);
    }
}

impl Estimator for Complementary {
    fn step(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Estimate, Error> {
        self.last.merge(z);
        let wheels = self.last.wheel_speed_mps.iter().flatten();
        let count = wheels.clone().count() as Real;
        let wheel = wheels.map(|s| s.value).sum::<Real>() / count.max(1.0);
        let Some(f) = self.last.specific_force_mps2.map(|s| s.value[0]) else {
            return Ok(Estimate::at(z.t));
        };
        let error = wheel - self.speed_mps;
        let acceleration = self.follow_grade(f, error, dt);
        let moving = wheel > MIN_SPEED_MPS && u.brake == 0.0;
        if moving {
            self.learn_mass(f, acceleration);
        }
        let value = |value, sd, valid| Value { value, sd, valid };
        let sd = self.variance.sqrt() + 0.01 * self.mass_kg;
        let mut estimate = Estimate::at(z.t);
        estimate.speed_mps = value(self.speed_mps, 0.02, true);
        estimate.grade_rad = value(self.grade_rad, 0.01, moving);
        estimate.effective_grade_rad = value(self.grade_rad, GRADE_ALONG_TRAIN_SD_RAD, moving);
        estimate.total_mass_kg = value(self.mass_kg, sd, sd < 0.1 * self.mass_kg);
        (estimate.flags.moving, estimate.innovation) = (moving, error);
        Ok(estimate)
    }

    fn reset(&mut self) {
        *self = Self::new(&self.vehicle, &self.params);
    }

    fn internals(&self) -> &[Internal] {
        const {
            &[
                Internal::new("residual", "N"),
                Internal::new("gyro_used", "-"),
            ]
        }
    }

    fn internal_values(&self, values: &mut [Real]) {
        let used = self.params.gyro && self.last.angular_rate_radps.is_some();
        let all = [self.residual2.sqrt(), if used { 1.0 } else { 0.0 }];
        values.iter_mut().zip(all).for_each(|(to, from)| *to = from);
    }
}
