//! A crane of one degree of freedom, written from the physics: a point mass on a slope, under a speed control, with
//! friction that brakes and holds, a force that nobody measures, and sensors with noise and errors.

use monorig_estimators::Real;
use monorig_estimators::Time;
use monorig_estimators::api::estimator::Estimator;
use monorig_estimators::api::signals::{Command, Estimate, Measurements, Sample};

use super::{Random, vehicle};

pub const G: Real = 9.81;
pub const DT: Real = 0.01;
pub const MASS_KG: Real = 15_000.0;
pub const MU: Real = 0.02;

/// The crane, its track, its sensors. Its speed control has no input of the slope.
#[derive(Clone, Copy)]
pub struct World {
    pub mu: Real,
    pub bias_mps2: Real,
    pub torque_gain: Real,
    /// Lateral acceleration in a bend to the left, m/s².
    pub across_mps2: Real,
    /// Grade angle, rad, at a chainage, m.
    pub grade: fn(Real) -> Real,
    /// Reference speed, m/s, at an instant, s.
    pub speed: fn(Real) -> Real,
    pub seconds: Real,
    pub seed: u64,
}

/// 1 m/s, rolling from the start.
pub fn steady(_: Real) -> Real {
    1.0
}

/// Starts from rest with 0.25 m/s².
pub fn start(t: Real) -> Real {
    (0.25 * (t - 1.0)).clamp(0.0, 1.0)
}

/// 0.6 and 1.2 m/s in turn, ten seconds each.
pub fn steps(t: Real) -> Real {
    if t % 20.0 < 10.0 { 0.6 } else { 1.2 }
}

pub fn level(_: Real) -> Real {
    0.0
}

pub fn steep(_: Real) -> Real {
    8f64.to_radians()
}

/// Level for 30 m, then a transition of 6 m to 8°.
pub fn ramp(s: Real) -> Real {
    let x = ((s - 30.0) / 6.0).clamp(0.0, 1.0);
    8f64.to_radians() * x * x * (3.0 - 2.0 * x)
}

/// Up and down again.
pub fn hills(s: Real) -> Real {
    0.1 * (s / 6.0).sin()
}

pub fn world(grade: fn(Real) -> Real, speed: fn(Real) -> Real) -> World {
    World {
        mu: MU,
        bias_mps2: 0.0,
        torque_gain: 1.0,
        across_mps2: 0.0,
        grade,
        speed,
        seconds: 60.0,
        seed: 1,
    }
}

impl World {
    /// Drives; returns each estimate with the grade that was true.
    pub fn run(&self, estimator: &mut impl Estimator) -> Vec<(Estimate, Real)> {
        self.run_watched(estimator, |_| ())
    }

    /// The same; `watch` sees the estimator after each step.
    pub fn run_watched<E: Estimator>(
        &self,
        estimator: &mut E,
        mut watch: impl FnMut(&E),
    ) -> Vec<(Estimate, Real)> {
        let vehicle = vehicle(2);
        let mut random = Random::new(self.seed);
        let (mut s, mut v): (Real, Real) = (0.0, (self.speed)(0.0));
        let mut force = MASS_KG * G * ((self.grade)(0.0).sin() + self.mu * v.signum());
        if v == 0.0 {
            force = 0.0;
        }
        let (mut integral, mut push) = (force, 0.0);
        let mut rows = Vec::new();
        for k in 1..=(self.seconds / DT) as usize {
            let t_s = k as Real * DT;
            let lack = (self.speed)(t_s) - v;
            integral += 1.5e4 * lack * DT;
            force += (3e4 * lack + integral - force) * DT / 0.15;
            push += -push * DT / 0.3 + 0.02 * (2.0 * DT / 0.3).sqrt() * random.normal();
            let theta = (self.grade)(s);
            let drive = force - MASS_KG * G * theta.sin() + MASS_KG * push;
            let friction = self.mu * MASS_KG * G * theta.cos();
            // Friction brakes and holds, it never drives.
            let inertia = MASS_KG + vehicle.rotating_mass_kg;
            let pushed = v + drive / inertia * DT;
            let next = if pushed > 0.0 {
                (pushed - friction / inertia * DT).max(0.0)
            } else {
                (pushed + friction / inertia * DT).min(0.0)
            };
            let a = (next - v) / DT;
            v = next;
            s += v * DT;

            let loss = if force * v >= 0.0 {
                1.0 / vehicle.efficiency
            } else {
                vehicle.efficiency
            };
            let torque = force * vehicle.wheel_radius_m / vehicle.gear_ratio * loss / 2.0;
            let mut z = Measurements {
                t: Time::from_s(t_s),
                ..Measurements::default()
            };
            let f = a + G * theta.sin() + self.bias_mps2 + 0.007 * random.normal();
            z.specific_force_mps2 = Some(Sample {
                t: Time::from_s(t_s),
                value: [f, self.across_mps2, G * theta.cos()],
            });
            let pitch = ((self.grade)(s) - theta) / DT;
            z.angular_rate_radps = Some(Sample {
                t: Time::from_s(t_s),
                value: [
                    0.0,
                    -pitch,
                    if v == 0.0 { 0.0 } else { self.across_mps2 / v },
                ],
            });
            for i in 0..2 {
                let noise = 0.01 * (50.0 + torque.abs()) * random.normal();
                z.motor_torque_nm[i] = Some(Sample {
                    t: Time::from_s(t_s),
                    value: torque * self.torque_gain + noise,
                });
                z.wheel_speed_mps[i] = Some(Sample {
                    t: Time::from_s(t_s),
                    value: v + 0.005 * random.normal(),
                });
            }
            let estimate = estimator.step(&z, &Command::default(), DT).unwrap();
            watch(estimator);
            rows.push((estimate, theta));
        }
        rows
    }
}
