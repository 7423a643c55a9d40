//! The train as one point on the rail: the analytic oracle for the rapier world, and the plant for long studies.
//!
//! ```text
//! (M + Σ J/r²) v̇ = F − M g sin θ(s) − R(v) − B        F = Σ T i η / r,  |F| ≤ Σ 2 µ N
//! ```
//!
//! Liu et al. 2023, eq. 1–7, with the rotating masses free of the stray g, and resistance term by term as in the world.

use crate::error::Error;
use crate::plant::train::adhesion::{self, AdhesionZone};
use crate::plant::train::balance::ForceBalance;
use crate::plant::train::motor::{Lag, TractionMotor, wheel_torque};
use crate::plant::train::resistance;
use crate::plant::{DriveState, MountState, Plant, PlantOptions, Truth};
use crate::rail::{Cursor, Rail, RailFrame};
use crate::train::{Drive, Train};
use monorig_estimators::api::signals::Command;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use std::sync::Arc;

/// The train as one point on the rail.
pub struct PointMass {
    train: Train,
    rail: Arc<Rail>,
    zones: Vec<AdhesionZone>,
    mounts: Vec<usize>,
    gravity: f64,
    tare_kg: f64,
    load_kg: f64,
    rotating_kg: f64,
    bound: f64,
    cursor: Cursor,
    v: f64,
    frame: RailFrame,
    drive: Drive,
    motor: TractionMotor,
    clamp: Lag,
    brake: Lag,
    clamp_limit_mpa: f64,
    offset: f64,
    ns: i64,
    truth: Truth,
}

impl PointMass {
    /// A point at the chainage of the IMU.
    pub fn new(train: Train, rail: Arc<Rail>, o: &PlantOptions) -> Self {
        let rotating_kg = train.rotating_mass_kg();
        let bound = train.rail_bound();
        let mount = &train.mounts[o.imu];
        let offset = train.bodies[mount.body].start_s + mount.pose.translation.x;
        // A train without drive units is a point without a motor.
        let none = Drive {
            wheel_radius_m: 1.0,
            gear_ratio: 1.0,
            efficiency_drive: 1.0,
            efficiency_brake: 1.0,
            speed_max_radps: 1.0,
            sigma0: 1.0,
            ..Drive::default()
        };
        let drive = train.drives.first().copied().unwrap_or(none);
        let clamp_mpa = drive.clamp_mpa;
        let (mounts, bodies) = (train.mounts.len(), train.bodies.len());
        let truth = Truth {
            balance: Some(ForceBalance::default()),
            ..Truth::with_room(mounts, train.drives.len(), bodies)
        };
        let mut this = Self {
            cursor: Cursor::at(o.front_m + offset),
            frame: rail.frame_without_steps(o.front_m + offset, &mut Cursor::default()),
            drive,
            motor: TractionMotor::default(),
            clamp: Lag { value: clamp_mpa },
            brake: Lag::default(),
            clamp_limit_mpa: f64::INFINITY,
            mounts: o.mounts.clone(),
            zones: o.zones.clone(),
            gravity: o.gravity_mps2,
            tare_kg: train.tare_kg(),
            load_kg: train.load_mass_kg(),
            rotating_kg,
            bound,
            v: o.speed_mps,
            offset,
            ns: 0,
            train,
            rail,
            truth,
        };
        let f = this.frame;
        this.update_truth(&f, 0.0, 0.0, 0.0, 0.0, 0.0);
        this.update_clearance();
        this
    }

    #[allow(clippy::too_many_arguments)]
    fn update_truth(
        &mut self,
        f: &RailFrame,
        accel: f64,
        traction: f64,
        against: f64,
        brake: f64,
        normal: f64,
    ) {
        let t = &mut self.truth;
        t.t_s = self.ns as f64 * 1e-9;
        t.chainage_m = f.s;
        t.speed_mps = self.v;
        t.speed_at_imu_mps = self.v;
        t.accel_mps2 = accel;
        t.grade_at_imu_rad = libm::asin(f.t.z.clamp(-1.0, 1.0));
        t.pitch_at_imu_rad = t.grade_at_imu_rad;
        t.grade_effective_rad = t.grade_at_imu_rad;
        t.curvature_vertical_1pm = f.k.dot(&f.u);
        t.curvature_horizontal_1pm = f.k.dot(&f.l) / libm::sqrt((1.0 - f.t.z * f.t.z).max(1e-12));
        t.total_mass_kg = self.tare_kg + self.load_kg;
        t.load_mass_kg = self.load_kg;
        t.traction_n = traction;
        t.resistance_n = against;
        t.brake_n = brake;
        t.running_resistance = if normal > 0.0 { against / normal } else { 0.0 };
        let r = Matrix3::from_columns(&[f.t, f.l, f.u]);
        let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(r));
        // The frame turns with the curve, w = v (t × k), and stays upright: the heading turns about the vertical, which
        // on a grade is a roll rate too.
        let heading_rate = self.v * t.curvature_horizontal_1pm;
        let w_w = f.t.cross(&f.k) * self.v + f.t * (heading_rate * f.t.z);
        for &i in &self.mounts {
            t.mounts[i] = MountState {
                v_w: f.t * self.v,
                q_wm: q,
                w_w,
            };
        }
    }
}

impl Plant for PointMass {
    fn step(&mut self, command: &Command, dt: f64) -> Result<(), Error> {
        let f = self.frame;
        let mass = self.tare_kg + self.load_kg;
        let weight = mass * self.gravity;
        let cos = libm::sqrt((1.0 - f.t.z * f.t.z).max(0.0));
        let (res, v) = (&self.train.resistance, self.v);

        // One motor, one clamp and one brake stand for all units: on a point they cannot differ.
        let (d, n) = (&self.drive, self.train.drives.len());
        let asked = command.motor_torque_nm.iter().take(n).sum::<f64>() / n.max(1) as f64;
        let omega = v / d.wheel_radius_m;
        let torque = self.motor.step(d, asked, omega, dt);
        let pressure_asked = command.clamp_pressure_mpa.min(self.clamp_limit_mpa);
        let pressure = self.clamp.step(pressure_asked, d.clamp_lag_s, dt);
        let clamp = pressure * 1e6 * d.piston_area_m2;
        let mu = adhesion::at(&self.zones, f.s, d.adhesion);
        let units = n as f64;
        let rim = units * wheel_torque(d, torque, omega) / d.wheel_radius_m;
        let limit = units * 2.0 * mu * clamp;
        let rolling = units * 2.0 * resistance::clamped_wheel(res, clamp, d.wheel_radius_m, omega)
            / d.wheel_radius_m;
        let (brake_max, brake_lag) = (units * d.brake_max_n, d.brake_lag_s);
        let traction = (rim - rolling).clamp(-limit, limit);
        self.truth.drives.fill(DriveState {
            chainage_m: f.s,
            motor_torque_nm: torque,
            wheel_rate_radps: [omega; 2],
            wheel_angle_rad: [0.0; 2],
            traction_n: traction / units,
            slip_mps: 0.0,
            clamp_mpa: pressure,
            adhesion: mu,
        });
        let against = resistance::direction(v)
            * (res.running_wheel * weight * cos + self.bound * res.bearing_n)
            + self.bound * res.bearing_nspm * v
            + resistance::air(res, v);
        let brake_limit = self.brake.step(command.brake * brake_max, brake_lag, dt);

        let inertia = mass + self.rotating_kg;
        let free = traction - weight * f.t.z - against;
        // The brake takes away what speed it can within the step, and no more.
        let brake = (-free - v * inertia / dt).clamp(-brake_limit, brake_limit);
        let accel = (free + brake) / inertia;
        let way = resistance::direction(v);
        let running = way * res.running_wheel * weight * cos;
        let air = resistance::air(res, v);
        self.truth.balance = Some(ForceBalance {
            // torque beyond adhesion spins the wheels, which are no state here
            drive_n: traction + rolling,
            clamped_rolling_n: -rolling,
            running_rolling_n: -running,
            guide_rolling_n: 0.0,
            bearing_n: running + air - against,
            air_n: -air,
            brake_n: brake,
            grade_n: -weight * f.t.z,
            curve_n: 0.0,
            contact_n: 0.0,
            inertia_n: inertia * accel,
            effective_mass_kg: inertia,
            speed_mps: v + accel * dt,
        });
        self.v += accel * dt;
        self.cursor.s += self.v * dt;
        self.ns += libm::round(dt * 1e9) as i64;
        let after = self
            .rail
            .frame_without_steps(self.cursor.s, &mut self.cursor);
        let normal = weight * cos;
        self.frame = after;
        self.update_truth(&after, accel, traction, against + rolling, brake, normal);
        if self.v.is_finite() {
            Ok(())
        } else {
            Err(Error::Broken {
                t_s: self.truth.t_s,
                what: "speed is not finite".into(),
            })
        }
    }

    fn truth(&self) -> &Truth {
        &self.truth
    }

    fn set_load_mass(&mut self, mass_kg: f64, speed_mps: Option<f64>) {
        let added = mass_kg - self.load_kg;
        if let Some(speed) = speed_mps.filter(|_| added > 0.0) {
            let inertia = self.tare_kg + self.load_kg + self.rotating_kg;
            self.v = (inertia * self.v + added * speed) / (inertia + added);
        }
        self.load_kg = mass_kg;
    }

    fn set_clamp_limit(&mut self, mpa: f64) {
        self.clamp_limit_mpa = mpa;
    }

    fn update_clearance(&mut self) {
        let front = self.cursor.s - self.offset;
        for (i, b) in self.train.bodies.iter().enumerate() {
            let f = self.rail.frame(front + b.start_s);
            let r = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[f.t, f.l, f.u]));
            let q = UnitQuaternion::from_rotation_matrix(&r);
            self.truth.poses[i] = (
                f.p + r * b.start_pose.translation.vector,
                q * b.start_pose.rotation,
            );
        }
    }
}
