//! The car as a plant: commands in, truth out.

use super::body::CarBody;
use super::car::Car;
use crate::error::Error;
use crate::plant::PlantOptions;
use crate::plant::{DriveState, MountState, Plant, RoadState, Truth};
use crate::rail::Rail;
use monorig_estimators::api::signals::Command;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use std::sync::Arc;

/// Below this speed a car has no sideslip angle: the direction of its velocity is noise, m/s.
const MIN_SIDESLIP_SPEED_MPS: f64 = 0.1;

/// A car on a road.
///
/// In its truth, `traction_n` is what the motors give at the rims, `resistance_n` rolling and air, `brake_n` what the
/// brakes take at the rims, so that M v̇ = traction − resistance − brake − weight, less what spins up wheels and what
/// bends cost. `running_resistance` is rolling alone, over the normal force. `off_rail_m` is the way beside the lane's
/// middle.
pub struct RoadPlant {
    /// The car in motion.
    pub car: CarBody,
    rail: Arc<Rail>,
    lane_m: f64,
    ns: i64,
    truth: Truth,
}

impl RoadPlant {
    /// A car in the middle of its lane.
    pub fn new(car: &Car, rail: Arc<Rail>, o: &PlantOptions) -> Self {
        let model = car.model(o.gravity_mps2);
        let body = CarBody::new(
            model,
            &rail,
            o.front_m - car.nose_m(),
            o.speed_mps,
            o.zones.clone(),
        );
        let lane_m = rail
            .outline()
            .iter()
            .fold(0.0, |most: f64, p| most.max(2.0 * p[0].abs()));
        let mut this = Self {
            car: body,
            rail,
            lane_m,
            ns: 0,
            truth: Truth {
                road: Some(RoadState::default()),
                total_mass_kg: model.geometry.mass_kg,
                ..Truth::with_room(1, 2, 1)
            },
        };
        this.truth.speed_mps = o.speed_mps;
        this.car.forces.along_mps = o.speed_mps;
        this.tell(0.0);
        this
    }

    /// Updates the truth; `dt` (s) is the time since the last update, 0 at the start.
    fn tell(&mut self, dt: f64) {
        let (x, f, s) = (&self.car.state, &self.car.forces, &self.car.surface);
        let (m, t) = (&self.car.model, &mut self.truth);
        t.t_s = self.ns as f64 * 1e-9;
        t.chainage_m = x.s;
        t.accel_mps2 = if dt > 0.0 {
            (f.along_mps - t.speed_mps) / dt
        } else {
            0.0
        };
        t.speed_mps = f.along_mps;
        t.speed_at_imu_mps = f.along_mps;
        t.grade_at_imu_rad = libm::asin(s.middle.t.z.clamp(-1.0, 1.0));
        let inside = 1.0 - x.offset * s.bend_1pm;
        let sine = (s.sine / inside).clamp(-1.0, 1.0);
        t.grade_effective_rad = libm::asin(sine);
        t.curvature_vertical_1pm = s.middle.k.dot(&s.middle.u);
        let level = libm::sqrt((1.0 - s.middle.t.z * s.middle.t.z).max(1e-12));
        t.curvature_horizontal_1pm = s.bend_1pm / level;
        let rolling = x
            .wheels
            .iter()
            .zip(0..4)
            .map(|(w, i)| w.stopping[1] / m.wheels[i / 2].radius_m);
        let rolling = rolling.sum::<f64>();
        t.traction_n = (0..2).map(|a| f.drive_nm[a] / m.wheels[a].radius_m).sum();
        t.brake_n = x
            .wheels
            .iter()
            .zip(0..4)
            .map(|(w, i)| w.stopping[0] / m.wheels[i / 2].radius_m)
            .sum();
        t.resistance_n = rolling + f.drag_n;
        t.running_resistance = if f.normal_n > 0.0 {
            rolling / f.normal_n
        } else {
            0.0
        };
        t.off_rail_m = x.offset.abs();
        for (axle, d) in t.drives.iter_mut().enumerate() {
            let pair = [x.wheels[2 * axle], x.wheels[2 * axle + 1]];
            let radius = m.wheels[axle].radius_m;
            let slips = pair.map(|w| w.rate * radius - f.along_mps);
            *d = DriveState {
                chainage_m: x.s + [m.geometry.front_m, -m.geometry.rear_m][axle],
                motor_torque_nm: x.motors[axle].torque(),
                wheel_rate_radps: pair.map(|w| w.rate),
                wheel_angle_rad: pair.map(|w| w.angle),
                traction_n: pair.iter().map(|w| w.force[0]).sum(),
                slip_mps: if slips[0].abs() > slips[1].abs() {
                    slips[0]
                } else {
                    slips[1]
                },
                clamp_mpa: 0.0,
                adhesion: f.grip[axle] * m.tyres[axle].adhesion_along,
            };
        }
        t.road = Some(RoadState {
            steering_rad: x.steering,
            offset_m: x.offset,
            heading_rad: x.heading,
            sideslip_rad: if libm::hypot(x.v[0], x.v[1]) < MIN_SIDESLIP_SPEED_MPS {
                f64::NAN
            } else {
                libm::atan2(x.v[1], x.v[0])
            },
            yaw_rate_radps: x.yaw_rate,
            lateral_mps2: f.tyre_n[1] / m.geometry.mass_kg,
            wheel_load_n: f.load_n,
        });

        // The body: pitch of the chord, heading against the lane, lean on the springs.
        let flat = Vector3::new(s.middle.t.x / level, s.middle.t.y / level, 0.0);
        let (sp, cp) = (libm::sin(s.pitch_rad), libm::cos(s.pitch_rad));
        let (ahead, left) = (flat * cp + Vector3::z() * sp, s.middle.l);
        let up = ahead.cross(&left);
        let road = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[ahead, left, up]));
        let lean = [
            m.suspension.roll_gradient * x.roll.q,
            -m.suspension.pitch_gradient * x.pitch.q,
        ];
        let q_road = UnitQuaternion::from_rotation_matrix(&road);
        let q = q_road * turn(2, x.heading) * turn(1, lean[1]) * turn(0, lean[0]);
        let rate = f.along_mps / inside;
        let axes = q * Vector3::x();
        let bend = Vector3::z() * (s.bend_1pm / level * rate);
        let climb = -left * (s.pitch_1pm * rate);
        let yaw = up * (x.yaw_rate - s.bend_1pm * rate);
        let sway = q * Vector3::new(
            m.suspension.roll_gradient * x.roll.rate,
            -m.suspension.pitch_gradient * x.pitch.rate,
            0.0,
        );
        let drift = x.v[0] * libm::sin(x.heading) + x.v[1] * libm::cos(x.heading);
        let climbing = flat * libm::sqrt(1.0 - sine * sine) + Vector3::z() * sine;
        t.mounts[0] = MountState {
            v_w: climbing * f.along_mps + left * drift,
            q_wm: q,
            w_w: bend + climb + yaw + sway,
        };
        t.pitch_at_imu_rad = libm::asin(axes.z.clamp(-1.0, 1.0));
        t.poses[0] = (s.middle.p + left * x.offset, q);
    }
}

/// Turn by a small angle about axis 0, 1 or 2.
fn turn(axis: usize, angle: f64) -> UnitQuaternion<f64> {
    let mut v = Vector3::zeros();
    v[axis] = libm::sin(0.5 * angle);
    UnitQuaternion::new_unchecked(nalgebra::Quaternion::from_parts(libm::cos(0.5 * angle), v))
}

impl Plant for RoadPlant {
    fn step(&mut self, command: &Command, dt: f64) -> Result<(), Error> {
        self.car.step(&self.rail, command, dt);
        self.ns += libm::round(dt * 1e9) as i64;
        self.tell(dt);
        let broken = |what: String| Error::Broken {
            t_s: self.truth.t_s,
            what,
        };
        let x = &self.car.state;
        if !(x.v[0].is_finite() && x.v[1].is_finite() && x.s.is_finite() && x.offset.is_finite()) {
            return Err(broken("the car's state is not finite".into()));
        }
        if x.offset.abs() > self.lane_m {
            return Err(broken(format!(
                "the car has left its lane: it is {:.1} m beside the middle",
                x.offset
            )));
        }
        Ok(())
    }

    fn truth(&self) -> &Truth {
        &self.truth
    }

    /// A car carries no load: scenarios that ask for one are refused.
    fn set_load_mass(&mut self, _mass_kg: f64, _speed_mps: Option<f64>) {}

    /// A car has no clamps: scenarios that ask for them are refused.
    fn set_clamp_limit(&mut self, _mpa: f64) {}
}
