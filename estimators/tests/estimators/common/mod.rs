//! Common parts of the integration tests and the bench: random numbers, a χ² band, a small crane that makes
//! measurements.

pub mod regression;
pub mod world;

use monorig_estimators::Real;
use monorig_estimators::Time;
use monorig_estimators::api::signals::{Measurements, Sample, Vehicle, VehicleData};

/// Splitmix64 (Steele, Lea & Flood 2014), normal numbers by Box & Muller 1958.
#[derive(Clone)]
pub struct Random {
    state: u64,
    spare: Option<Real>,
}

impl Random {
    pub fn new(seed: u64) -> Self {
        Self {
            state: seed.wrapping_mul(0xD134_2543_DE82_EF95),
            spare: None,
        }
    }

    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in 0…1, never 0.
    pub fn uniform(&mut self) -> Real {
        ((self.bits() >> 11) as Real + 0.5) / (1u64 << 53) as Real
    }

    /// Uniform among 0…`count` − 1.
    pub fn below(&mut self, count: usize) -> usize {
        (self.bits() % count as u64) as usize
    }

    pub fn chance(&mut self, probability: Real) -> bool {
        self.uniform() < probability
    }

    pub fn normal(&mut self) -> Real {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        let (sine, cosine) = (2.0 * std::f64::consts::PI * self.uniform()).sin_cos();
        self.spare = Some(radius * sine);
        radius * cosine
    }
}

/// Two-sided 95 % band of the mean of χ² variables with `degrees` in all (Wilson & Hilferty 1931), divided by
/// `degrees`.
pub fn chi_square_band(degrees: usize) -> (Real, Real) {
    let a = 2.0 / (9.0 * degrees as Real);
    let at = |z: Real| (1.0 - a + z * a.sqrt()).powi(3);
    (at(-1.96), at(1.96))
}

/// Vehicle for the estimators.
pub fn vehicle(drives: usize) -> Vehicle {
    Vehicle::new(VehicleData {
        tare_kg: 5_000.0,
        drives,
        wheel_radius_m: 0.17,
        gear_ratio: 20.0,
        efficiency: 0.9,
        rotating_mass_kg: 1_045.0,
        running_resistance: 0.02,
        mass_range_kg: [5_000.0, 27_000.0],
        ..VehicleData::default()
    })
    .unwrap()
}

const GRAVITY: Real = 9.81;

/// A point mass on a slope that follows a wanted speed with at most `most_mps2`; the traction it takes comes from the
/// force balance (inverse dynamics). Sensors have white noise.
#[derive(Clone)]
pub struct Crane {
    pub vehicle: Vehicle,
    pub mass_kg: Real,
    pub grade_rad: Real,
    pub most_mps2: Real,
    pub t_s: Real,
    pub speed_mps: Real,
    pub chainage_m: Real,
    /// Grade angle of the step before, rad: what the pitch gyro needs.
    pub last_grade_rad: Option<Real>,
    pub random: Random,
}

impl Crane {
    pub fn new(vehicle: Vehicle, mass_kg: Real, seed: u64) -> Self {
        Self {
            vehicle,
            mass_kg,
            grade_rad: 0.0,
            most_mps2: 0.3,
            t_s: 0.0,
            speed_mps: 0.0,
            chainage_m: 0.0,
            last_grade_rad: None,
            random: Random::new(seed),
        }
    }

    /// One step towards the speed `wanted_mps`; all sensors send.
    pub fn step(&mut self, wanted_mps: Real, dt: Real) -> Measurements {
        let most = self.most_mps2;
        let mut a = ((wanted_mps - self.speed_mps) / dt.max(0.3)).clamp(-most, most);
        if wanted_mps == 0.0 && self.speed_mps.abs() < 0.02 {
            a = -self.speed_mps / dt;
        }
        self.speed_mps += a * dt;
        self.chainage_m += self.speed_mps * dt;
        self.t_s += dt;
        let (sine, cosine) = self.grade_rad.sin_cos();
        let direction = if self.speed_mps == 0.0 {
            0.0
        } else {
            self.speed_mps.signum()
        };
        let weight = self.mass_kg * GRAVITY;
        let vehicle = &self.vehicle;
        let force = (self.mass_kg + vehicle.rotating_mass_kg) * a
            + weight * (sine + direction * vehicle.running_resistance * cosine);
        let loss = if force * self.speed_mps >= 0.0 {
            1.0 / vehicle.efficiency
        } else {
            vehicle.efficiency
        };
        let torque =
            force * vehicle.wheel_radius_m / vehicle.gear_ratio * loss / vehicle.drives as Real;

        let before = self.last_grade_rad.replace(self.grade_rad);
        let pitch = (self.grade_rad - before.unwrap_or(self.grade_rad)) / dt;
        let (t_s, random) = (self.t_s, &mut self.random);
        let mut z = Measurements {
            t: Time::from_s(t_s),
            ..Measurements::default()
        };
        let f = a + GRAVITY * sine + 0.007 * random.normal();
        // the centripetal acceleration of the hill
        let up = GRAVITY * cosine + self.speed_mps * pitch;
        z.specific_force_mps2 = Some(Sample {
            t: Time::from_s(t_s),
            value: [f, 0.0, up],
        });
        z.angular_rate_radps = Some(Sample {
            t: Time::from_s(t_s),
            value: [0.0, 1e-4 * random.normal() - pitch, 1e-4 * random.normal()],
        });
        for i in 0..vehicle.drives {
            z.motor_torque_nm[i] = Some(Sample {
                t: Time::from_s(t_s),
                value: torque + 0.01 * (50.0 + torque.abs()) * random.normal(),
            });
            z.wheel_speed_mps[i] = Some(Sample {
                t: Time::from_s(t_s),
                value: self.speed_mps + 0.005 * random.normal(),
            });
        }
        z
    }
}
