//! A simulated crane for the tests: one degree of freedom, written from the physics and not from the filters' code.

use crate::Real;
use crate::Time;
use crate::api::estimator::Estimator;
use crate::api::reading::Reading;
use crate::api::signals::{
    Command, Estimate, Measurements, RoadVehicle, Sample, Vehicle, VehicleData,
};
use crate::testing::Random;
use std::vec::Vec;

/// Vehicle for the estimators.
pub fn vehicle() -> Vehicle {
    Vehicle::new(VehicleData {
        tare_kg: 5_000.0,
        drives: 8,
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

/// The road vehicle of Guo et al. 2024; values that the paper does not give are invented.
pub fn car() -> Vehicle {
    Vehicle::new(VehicleData {
        tare_kg: 1_900.0,
        drives: 2,
        wheel_radius_m: 0.335,
        gear_ratio: 7.235,
        efficiency: 0.95,
        rotating_mass_kg: 65.0,
        running_resistance: 0.0092,
        mass_range_kg: [1_500.0, 3_000.0],
        road: Some(RoadVehicle {
            drag_area_m2: 0.332 * 2.574,
            air_density_kgpm3: 1.2258,
            front_axle_m: 1.4,
            rear_axle_m: 1.4,
            front_cornering_npr: 120e3,
            rear_cornering_npr: 130e3,
        }),
        ..VehicleData::default()
    })
    .unwrap()
}

/// The road vehicle in a steady turn up a grade, solved from the forces of its axles and not from the estimators'
/// formulas.
pub struct Turn {
    pub speed: Real,
    pub yaw_rate: Real,
    pub steer: Real,
    pub lateral_speed: Real,
    /// g sin θ of the grade, m/s².
    pub uphill: Real,
    /// Traction at the rims, half of it at each axle, N.
    pub traction: Real,
}

impl Turn {
    /// Measurements of the instruments at an instant.
    pub fn measurements(&self, t_s: Real) -> Measurements {
        let reading = self.reading();
        let sample = |value: Option<Real>| {
            value.map(|value| Sample {
                t: Time::from_s(t_s),
                value,
            })
        };
        let mut z = Measurements {
            t: Time::from_s(t_s),
            steering_angle_rad: sample(reading.steering_angle_rad),
            ..Default::default()
        };
        let value = [
            reading.specific_force_mps2.unwrap(),
            reading.lateral_force_mps2.unwrap(),
            (9.81 * 9.81 - self.uphill * self.uphill).sqrt(),
        ];
        z.specific_force_mps2 = Some(Sample {
            t: Time::from_s(t_s),
            value,
        });
        // The heading turns about the vertical, which on a grade is not the upward axis of the car.
        let (sine, cosine) = (
            self.uphill / 9.81,
            (1.0 - (self.uphill / 9.81).powi(2)).sqrt(),
        );
        let value = [self.yaw_rate * sine, 0.0, self.yaw_rate * cosine];
        z.angular_rate_radps = Some(Sample {
            t: Time::from_s(t_s),
            value,
        });
        for i in 0..2 {
            z.motor_torque_nm[i] = sample(reading.front_torque_nm);
            z.wheel_speed_mps[i] = sample(reading.speed_mps);
        }
        z
    }

    /// Newton's method on steering angle, lateral speed and traction, until the forces along and across and the moments
    /// balance.
    pub fn solve(mass: Real, speed: Real, yaw_rate: Real, uphill: Real) -> Self {
        let (vehicle, road) = (car(), car().road.unwrap());
        let drag = 0.5 * road.air_density_kgpm3 * road.drag_area_m2 * speed * speed;
        let resistance = mass * (9.81 * vehicle.running_resistance + uphill);
        let lack = |x: nalgebra::Vector3<Real>| {
            let (steer, lateral_speed, traction) = (x.x, x.y, x.z);
            let front_slip =
                steer - ((lateral_speed + road.front_axle_m * yaw_rate) / speed).atan();
            let rear_slip = -((lateral_speed - road.rear_axle_m * yaw_rate) / speed).atan();
            let (front, rear) = (
                road.front_cornering_npr * front_slip,
                road.rear_cornering_npr * rear_slip,
            );
            let half = 0.5 * traction;
            let across = front * steer.cos() + half * steer.sin();
            nalgebra::vector![
                half * steer.cos() - front * steer.sin() + half - drag - resistance
                    + mass * lateral_speed * yaw_rate,
                across + rear - mass * speed * yaw_rate,
                road.front_axle_m * across - road.rear_axle_m * rear
            ]
        };
        let mut x = nalgebra::vector![2.8 * yaw_rate / speed, 0.0, drag + resistance];
        for _ in 0..50 {
            let steps = [1e-7, 1e-7, 1e-2];
            let mut J = nalgebra::Matrix3::zeros();
            for (i, h) in steps.into_iter().enumerate() {
                let mut moved = x;
                moved[i] += h;
                J.set_column(i, &((lack(moved) - lack(x)) / h));
            }
            x -= J.lu().solve(&lack(x)).unwrap();
        }
        assert!(lack(x).norm() < 1e-6);
        Turn {
            speed,
            yaw_rate,
            steer: x.x,
            lateral_speed: x.y,
            uphill,
            traction: x.z,
        }
    }

    /// Readings of instruments without error.
    pub fn reading(&self) -> Reading {
        let vehicle = car();
        let torque =
            self.traction * vehicle.wheel_radius_m / vehicle.gear_ratio / vehicle.efficiency;
        Reading {
            new_speed_mps: Some(self.speed),
            speed_mps: Some(self.speed),
            wheel_speed_fault: None,
            motor_torque_nm: Some(torque),
            front_torque_nm: Some(0.5 * torque),
            specific_force_mps2: Some(self.uphill - self.lateral_speed * self.yaw_rate),
            lateral_force_mps2: Some(self.speed * self.yaw_rate),
            pitch_rate_radps: Some(0.0),
            yaw_rate_radps: Some(self.yaw_rate),
            steering_angle_rad: Some(self.steer),
            brake: 0.0,
            ..Reading::default()
        }
    }
}

/// The crane as it is, its sensors and its speed control.
#[derive(Clone, Copy)]
pub struct World {
    pub mass_kg: Real,
    /// Load picked up or set down at an instant: (s, total mass after it).
    pub mass_change: Option<(Real, Real)>,
    pub mu: Real,
    /// Running resistance that does not grow with the mass, N.
    pub drag_n: Real,
    /// Horizontal curvature, 1/m, at a chainage, m, and what it adds to the running-resistance coefficient, times the
    /// radius, m.
    pub curve: fn(Real) -> Real,
    pub curve_resistance_m: Real,
    pub accel_bias: Real,
    pub torque_gain: Real,
    pub disturbance: Real,
    pub speed_sd: Real,
    pub accel_sd: Real,
    pub torque_noise: Real,
    /// Over what the tare is spread and between what the load hangs, m behind the instrument, nearest and farthest:
    /// both 0 for a point.
    pub tare_span_m: [Real; 2],
    pub load_span_m: [Real; 2],
    /// Grade angle, rad, at a chainage, m.
    pub grade: fn(Real) -> Real,
    /// Reference speed, m/s, at an instant, s.
    pub speed: fn(Real) -> Real,
    pub seconds: Real,
    /// Speed at the start, m/s; the torque starts at the value that keeps this speed.
    pub start_mps: Real,
    pub seed: u64,
}

/// A start, a level piece, a transition to 8°, back to level.
pub fn world(seed: u64) -> World {
    World {
        mass_kg: 15_000.0,
        mass_change: None,
        mu: 0.02,
        drag_n: 0.0,
        curve: |_| 0.0,
        curve_resistance_m: 0.0,
        accel_bias: 0.0,
        torque_gain: 1.0,
        disturbance: 0.02,
        speed_sd: 0.005,
        accel_sd: 0.007,
        torque_noise: 0.01,
        tare_span_m: [0.0; 2],
        load_span_m: [0.0; 2],
        grade: |s| 8f64.to_radians() * (smooth((s - 15.0) / 8.0) - smooth((s - 40.0) / 8.0)),
        speed: |t| (0.25 * (t - 1.0)).clamp(0.0, 1.0),
        seconds: 60.0,
        start_mps: 0.0,
        seed,
    }
}

/// 0 below 0, 1 above 1, smooth between.
pub fn smooth(x: Real) -> Real {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// Truth and estimates at one instant.
#[derive(Clone, Copy)]
pub struct Row {
    pub t: Real,
    pub s: Real,
    pub mass: Real,
    pub theta: Real,
    pub effective: Real,
    pub estimate: Estimate,
}

pub const DT: Real = 0.005;

impl World {
    /// Drives the crane for its time; `estimator` sees IMU at 200 Hz, torque and wheel speed at 100 Hz.
    pub fn run(&self, estimator: &mut impl Estimator) -> Vec<Row> {
        let vehicle = vehicle();
        let mut random = Random::new(self.seed);
        let (mut s, mut v, mut push) = (0.0, self.start_mps, 0.0);
        let mut force = if v == 0.0 {
            0.0
        } else {
            self.steady_force((self.grade)(0.0))
        };
        let mut integral = force;
        let mut last_theta = (self.grade)(0.0);
        let mut rows = Vec::new();
        for k in 1..=(self.seconds / DT) as usize {
            let t = k as Real * DT;
            let mass = self
                .mass_change
                .filter(|(at, _)| t >= *at)
                .map_or(self.mass_kg, |(_, after)| after);
            // speed control and motor lag
            let lack = (self.speed)(t) - v;
            integral += 1.5e4 * lack * DT;
            force += (3e4 * lack + integral - force) * DT / 0.15;
            // (M + J) v̇ = F − M g sin θ − friction + disturbance, with friction that holds a standing train
            let theta = (self.grade)(s);
            let pitch_rate = (theta - last_theta) / DT;
            last_theta = theta;
            push += -push * DT / 0.3 + self.disturbance * (2.0 * DT / 0.3).sqrt() * random.normal();
            let effective = self.effective_grade(s, mass);
            let drive = force - mass * 9.81 * effective.sin() + mass * push;
            let friction = (self.mu + self.curve_resistance_m * (self.curve)(s).abs())
                * mass
                * 9.81
                * theta.cos()
                + self.drag_n;
            let stands = v.abs() < 1e-9 && drive.abs() < friction;
            let direction = if v.abs() > 1e-9 {
                v.signum()
            } else {
                drive.signum()
            };
            let net = if stands {
                0.0
            } else {
                drive - direction * friction
            };
            let mut a = net / (mass + vehicle.rotating_mass_kg);
            if v != 0.0 && (v + a * DT) * v < 0.0 && drive.abs() < friction {
                a = -v / DT;
            }
            v += a * DT;
            s += v * DT;

            let mut z = Measurements {
                t: Time::from_s(t),
                ..Default::default()
            };
            // The heading turns about the vertical.
            let heading_rate = v * (self.curve)(s);
            let (roll_rate, yaw_rate) = (heading_rate * theta.sin(), heading_rate * theta.cos());
            let f = a + 9.81 * theta.sin() + self.accel_bias + self.accel_sd * random.normal();
            z.specific_force_mps2 = Some(Sample {
                t: Time::from_s(t),
                value: [f, v * yaw_rate, 9.81 * theta.cos() + v * pitch_rate],
            });
            let rate = pitch_rate + 1e-4 * random.normal();
            z.angular_rate_radps = Some(Sample {
                t: Time::from_s(t),
                value: [roll_rate, -rate, yaw_rate + 1e-4 * random.normal()],
            });
            if k % 2 == 0 {
                let loss = if force * v >= 0.0 {
                    1.0 / vehicle.efficiency
                } else {
                    vehicle.efficiency
                };
                let torque = force * vehicle.wheel_radius_m / vehicle.gear_ratio * loss
                    / vehicle.drives as Real;
                for i in 0..vehicle.drives {
                    let noise = self.torque_noise * (50.0 + torque.abs()) * random.normal();
                    z.motor_torque_nm[i] = Some(Sample {
                        t: Time::from_s(t),
                        value: torque * self.torque_gain + noise,
                    });
                    z.wheel_speed_mps[i] = Some(Sample {
                        t: Time::from_s(t),
                        value: v + self.speed_sd * random.normal(),
                    });
                }
            }
            let estimate = estimator.step(&z, &Command::default(), DT).unwrap();
            rows.push(Row {
                t,
                s,
                mass,
                theta,
                effective,
                estimate,
            });
        }
        rows
    }

    /// asin of the mean of sin θ over all masses.
    pub fn effective_grade(&self, s: Real, mass: Real) -> Real {
        let mean = |[nearest, farthest]: [Real; 2]| {
            let at = |k: i32| nearest + (farthest - nearest) * (k as Real + 0.5) / 40.0;
            (0..40).map(|k| (self.grade)(s - at(k)).sin()).sum::<Real>() / 40.0
        };
        // The load hangs at both ends of its span.
        let load = self.load_span_m.map(|at| (self.grade)(s - at).sin());
        let tare = vehicle().tare_kg / mass;
        (tare * mean(self.tare_span_m) + (1.0 - tare) * 0.5 * (load[0] + load[1])).asin()
    }

    /// Traction, N, that keeps a forward speed on a grade.
    fn steady_force(&self, theta: Real) -> Real {
        self.mass_kg * 9.81 * (theta.sin() + self.mu * theta.cos())
    }
}

/// Largest mass error, as a share of the mass, from an instant on.
pub fn mass_error(rows: &[Row], from_s: Real) -> Real {
    rows.iter()
        .filter(|row| row.t >= from_s)
        .map(|row| (row.estimate.total_mass_kg.value / row.mass - 1.0).abs())
        .fold(0.0, Real::max)
}

/// Root mean square of the grade error, deg, from an instant on.
pub fn grade_error_deg(rows: &[Row], from_s: Real) -> Real {
    let errors: Vec<Real> = rows
        .iter()
        .filter(|row| row.t >= from_s)
        .map(|row| (row.estimate.grade_rad.value - row.theta).to_degrees())
        .collect();
    crate::testing::rms(&errors)
}
