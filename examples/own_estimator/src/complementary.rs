//! Slope by a complementary filter on accelerometer, gyro and wheels; mass by recursive least squares on the force balance.

use monorig_estimators::{
    Command, Error, Estimate, Estimator, Internal, Measurements, Real, Value, Vehicle, params,
};
use std::collections::VecDeque;
use std::f64::consts::TAU;

const G: Real = 9.81;
/// Friction at standstill is not the running resistance, m/s.
const MIN_SPEED_MPS: Real = 0.1;

params! {
    /// Parameters of [`Complementary`].
    ComplementaryParams {
        crossover_hz ["Hz"] = 0.15, 0.005 => 2.0, "Below it the slope follows accelerometer and wheels, above it the gyro.";
        forgetting ["-"] = 0.9998, 0.99 => 1.0, "Forgetting factor of the mass regression, per step.";
        window_s ["s"] = 0.2, 0.005 => 2.0, "Forces and accelerations are averaged over this time.";
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
    /// Variance of the mass, kg², and mean square of the residuals, N².
    variance: Real,
    residual2: Real,
    /// Force minus that of the rotating masses (N) and the acceleration that the mass answers it with (m/s²).
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

    /// Force of the motors at the rims, N: losses take from it when they drive and help when they brake.
    fn rim_force_n(&self) -> Real {
        let v = &self.vehicle;
        let torques = self.last.motor_torque_nm.iter().flatten();
        let force = torques.map(|s| s.value).sum::<Real>() * v.gear_ratio / v.wheel_radius_m;
        force * v.efficiency.powf(force.signum())
    }
}

impl Estimator for Complementary {
    fn step(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Estimate, Error> {
        self.last.merge(z);
        let mut wheels: Vec<Real> = self
            .last
            .wheel_speed_mps
            .iter()
            .flatten()
            .map(|s| s.value)
            .collect();
        wheels.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
        let (Some(f), Some(&wheel)) = (self.last.specific_force_mps2, wheels.get(wheels.len() / 2))
        else {
            return Ok(Estimate::at(z.t));
        };
        // observer of speed and grade: two poles at the crossover, damping 0.7
        let rate = self
            .last
            .angular_rate_radps
            .filter(|_| self.params.gyro)
            .map_or(0.0, |s| -s.value[1]);
        let (omega, error) = (TAU * self.params.crossover_hz, wheel - self.speed_mps);
        let acceleration = f.value[0] - G * self.grade_rad.sin();
        self.speed_mps += dt * (acceleration + 1.4 * omega * error);
        self.grade_rad =
            (self.grade_rad + dt * (rate - omega * omega / G * error)).clamp(-0.7, 0.7);
        // F − m_rot·a = m·(f_x + c·g·cos θ): a regression with one unknown, on averages
        let resisting = self.vehicle.running_resistance * G * self.grade_rad.cos();
        let force = self.rim_force_n() - self.vehicle.rotating_mass_kg * acceleration;
        self.window.push_back([force, f.value[0] + resisting]);
        while self.window.len() as Real * dt > self.params.window_s + dt {
            self.window.pop_front();
        }
        let n = self.window.len() as Real;
        let [y, h] = self
            .window
            .iter()
            .fold([0.0; 2], |s, w| [s[0] + w[0] / n, s[1] + w[1] / n]);
        let moving = wheel > MIN_SPEED_MPS && u.brake == 0.0;
        if moving {
            let residual = y - h * self.mass_kg;
            let gain = self.variance * h / (h * self.variance * h + self.residual2);
            let [low, high] = self.vehicle.mass_range_kg;
            self.mass_kg = (self.mass_kg + gain * residual).clamp(low, high);
            self.variance = ((1.0 - gain * h) * self.variance / self.params.forgetting)
                .min((high - low).powi(2));
            self.residual2 += 1e-3 * (residual * residual - self.residual2);
        }
        let sd = self.variance.sqrt() + 0.01 * self.mass_kg;
        let value = |value, sd, valid| Value { value, sd, valid };
        let mut estimate = Estimate::at(z.t);
        estimate.speed_mps = value(self.speed_mps, 0.02, true);
        estimate.grade_rad = value(self.grade_rad, 0.01, moving);
        estimate.effective_grade_rad = estimate.grade_rad;
        estimate.total_mass_kg = value(self.mass_kg, sd, sd < 0.1 * self.mass_kg);
        (estimate.flags.moving, estimate.innovation) = (moving, error);
        Ok(estimate)
    }

    fn reset(&mut self) {
        *self = Self::new(&self.vehicle, &self.params);
    }

    fn internals(&self) -> &[Internal] {
        &[Internal::new("residual", "N"), Internal::new("window", "-")]
    }

    fn internal_values(&self, values: &mut [Real]) {
        let all = [self.residual2.sqrt(), self.window.len() as Real];
        values.iter_mut().zip(all).for_each(|(to, from)| *to = from);
    }
}
