//! Bound of the slope: accelerometer, gyro and wheels.

use super::sheet::SheetNoise;
use nalgebra::{SMatrix, SVector};

type Covariance = SMatrix<f64, STATES, STATES>;
type Row = SVector<f64, STATES>;

/// δv, δθ, b_x, b_z, b_g, e_w.
const STATES: usize = 6;
const V: usize = 0;
const TILT: usize = 1;
const BIAS_X: usize = 2;
const BIAS_Z: usize = 3;
const BIAS_GYRO: usize = 4;
const WHEEL_SCALE: usize = 5;
/// Speed at the start, m/s, and acceleration while it stands, m/s²: the train is known to stand.
const STARTS_AT: (f64, f64) = (0.01, 0.02);
/// Without a gyro: growth of the variance of the grade by way, rad²/m, and standing, rad²/s.
const UNKNOWN_RAIL: (f64, f64) = (1e-2, 5e-4);

/// The true motion at the IMU.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Motion {
    /// Speed, m/s.
    pub(crate) speed_mps: f64,
    pub(crate) grade_rad: f64,
    /// Its rate, rad/s.
    pub(crate) grade_rate_radps: f64,
    /// Gravity, m/s².
    pub(crate) gravity_mps2: f64,
}

/// Kalman covariance of the attitude, linearised at the true motion:
///
/// ```text
/// v̇ = f_x − b_x − g sin θ      θ̇ = ω − b_g
/// wheels  v (1 + e_w)           f_z  v θ̇ + g cos θ + b_z
/// ```
pub(crate) struct AttitudeBound {
    noise: SheetNoise,
    drives: f64,
    covariance: Option<Covariance>,
}

impl AttitudeBound {
    /// Makes the bound for instruments with this noise.
    pub(crate) fn new(noise: SheetNoise) -> Self {
        Self {
            noise,
            drives: 1.0,
            covariance: None,
        }
    }

    /// Sets the number of measured wheels.
    pub(crate) fn drives(&mut self, drives: usize) {
        self.drives = drives.max(1) as f64;
    }

    /// Time between two steps, s; none if the sheet has no accelerometer or no wheel speed.
    pub(crate) fn step_s(&self) -> Option<f64> {
        self.noise.wheel_speed?;
        Some(1.0 / self.noise.accelerometer?.rate_hz)
    }

    /// Advances by one sample of the accelerometer.
    pub(crate) fn step(&mut self, m: Motion) {
        let (Some(accelerometer), Some(wheels)) =
            (self.noise.accelerometer, self.noise.wheel_speed)
        else {
            return;
        };
        let (dt, g) = (1.0 / accelerometer.rate_hz, m.gravity_mps2);
        let (sin, cos) = (libm::sin(m.grade_rad), libm::cos(m.grade_rad));
        let white = accelerometer.white_sd * accelerometer.white_sd;
        let bias = accelerometer.bias_sd * accelerometer.bias_sd;
        let gyro_bias = self.noise.gyro.map_or(0.0, |n| n.bias_sd * n.bias_sd);
        let scale = wheels.scale_sd * wheels.scale_sd / self.drives;
        let mut p = self.covariance.unwrap_or_else(|| {
            let (speed, still) = STARTS_AT;
            let mut p = Covariance::from_diagonal(&Row::from([
                speed * speed,
                (bias / (cos * cos) + still * still) / (g * g),
                bias,
                bias,
                gyro_bias,
                scale,
            ]));
            // it stands: g θ + b_x is measured
            p[(TILT, BIAS_X)] = -bias / (g * cos);
            p[(BIAS_X, TILT)] = p[(TILT, BIAS_X)];
            p
        });

        let mut f = Covariance::identity();
        f[(V, TILT)] = -g * cos * dt;
        f[(V, BIAS_X)] = -dt;
        f[(TILT, BIAS_GYRO)] = dt;
        p = f * p * f.transpose();
        p[(V, V)] += white * dt * dt;
        p[(TILT, TILT)] += match self.noise.gyro {
            Some(n) => n.white_sd * n.white_sd / n.rate_hz * dt,
            None => (UNKNOWN_RAIL.0 * m.speed_mps.abs() + UNKNOWN_RAIL.1) * dt,
        };
        p[(BIAS_GYRO, BIAS_GYRO)] +=
            self.noise.gyro.map_or(0.0, |n| n.bias_walk * n.bias_walk) * dt;
        let walk = accelerometer.bias_walk * accelerometer.bias_walk * dt;
        p[(BIAS_X, BIAS_X)] += walk;
        p[(BIAS_Z, BIAS_Z)] += walk;

        let mut h = Row::zeros();
        h[V] = 1.0;
        h[WHEEL_SCALE] = m.speed_mps;
        // as much as comes in during a step, from all wheels
        let samples = wheels.rate_hz * dt * self.drives;
        measure(&mut p, h, wheels.white_sd * wheels.white_sd / samples);
        let mut h = Row::zeros();
        h[V] = m.grade_rate_radps;
        h[TILT] = -g * sin;
        h[BIAS_Z] = 1.0;
        measure(&mut p, h, white);
        self.covariance = Some(p);
    }

    /// Standard deviations of the tilt and of the accelerometer's bias along the train, rad and m/s².
    pub(crate) fn sd(&self) -> Option<(f64, f64)> {
        let p = self.covariance?;
        Some((p[(TILT, TILT)].sqrt(), p[(BIAS_X, BIAS_X)].sqrt()))
    }
}

fn measure(p: &mut Covariance, h: Row, variance: f64) {
    let ph = *p * h;
    let s = h.dot(&ph) + variance;
    if s > 0.0 {
        *p -= ph * ph.transpose() / s;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bound::sheet::InstrumentNoise;

    fn bound() -> AttitudeBound {
        let at = |rate_hz, white_sd, bias_sd| {
            Some(InstrumentNoise {
                rate_hz,
                white_sd,
                bias_sd,
                ..InstrumentNoise::default()
            })
        };
        AttitudeBound::new(SheetNoise {
            accelerometer: at(200.0, 0.01, 0.01),
            gyro: at(200.0, 6e-4, 0.0),
            wheel_speed: at(200.0, 0.005, 0.0),
            motor_torque: None,
        })
    }

    fn run(bound: &mut AttitudeBound, seconds: f64, grade_rad: f64) -> (f64, f64) {
        for _ in 0..(seconds * 200.0) as usize {
            bound.step(Motion {
                speed_mps: 1.0,
                grade_rad,
                grade_rate_radps: 0.0,
                gravity_mps2: 9.81,
            });
        }
        bound.sd().unwrap()
    }

    /// On the level the bias cannot be separated from the tilt, and the bound is that of the bias: b/g.
    #[test]
    fn on_the_level_the_bound_is_the_bias_over_gravity() {
        let (tilt, bias) = run(&mut bound(), 60.0, 0.0);
        assert!((bias - 0.01).abs() < 1e-4, "{bias}");
        assert!((tilt / (0.01 / 9.81) - 1.0).abs() < 0.02, "{tilt}");
    }

    /// On a slope |f| = g separates them: after t seconds b is known to about σ/(sin θ √(n)), closed form of the
    /// information of f_z and f_x.
    #[test]
    fn on_a_slope_the_bias_is_found_at_the_rate_of_the_closed_form() {
        let mut bound = bound();
        run(&mut bound, 5.0, 0.0);
        let slope = 0.2f64;
        let (_, bias) = run(&mut bound, 60.0, slope);
        // level: b_z known; slope: z = −g sin θ δθ + b_z with δθ = −b_x/(g cos θ): b_x tan θ is measured n times with
        // the noise of f_z
        let n = 60.0 * 200.0;
        let before = 0.01f64.hypot(0.0);
        let measured = 0.01 / (slope.tan() * f64::sqrt(n));
        let level = 0.01 / (slope.tan() * f64::sqrt(5.0 * 200.0)); // b_z itself, from the level
        let expected =
            1.0 / (1.0 / (before * before) + 1.0 / (measured.hypot(level)).powi(2)).sqrt();
        assert!((bias / expected - 1.0).abs() < 0.25, "{bias} {expected}");
    }

    /// More of an instrument's noise is never a smaller bound.
    #[test]
    fn more_noise_is_a_larger_bound() {
        let better = run(&mut bound(), 20.0, 0.1).0;
        let mut worse = bound();
        worse.noise.gyro = worse.noise.gyro.map(|n| InstrumentNoise {
            white_sd: 5.0 * n.white_sd,
            ..n
        });
        assert!(run(&mut worse, 20.0, 0.1).0 > better);
        let mut without = bound();
        without.noise.gyro = None;
        assert!(run(&mut without, 20.0, 0.1).0 > better);
    }
}
