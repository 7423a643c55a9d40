//! Computes the truth from the bodies after a step.

use super::World;
use crate::plant::{DriveState, MountState};
use nalgebra::Vector3;

impl World {
    /// Updates the truth, `dt` (s) after the last update.
    pub(super) fn update_truth(&mut self, dt: f64) {
        let t = &mut self.truth;
        let train = &self.dynamics.train;
        let states = self.bodies.states();
        for &i in &self.mounts {
            let m = &train.mounts[i];
            let s = states[m.body];
            let at = s.point(&m.pose.translation.vector);
            t.mounts[i] = MountState {
                v_w: s.velocity(&at),
                q_wm: s.q * m.pose.rotation,
                w_w: s.w,
            };
        }
        let m = &train.mounts[self.imu.0];
        let s = states[m.body];
        let at = s.point(&m.pose.translation.vector);
        let f = self.rail.track_without_steps(&at, &mut self.imu.1);
        t.speed_at_imu_mps = s.velocity(&at).dot(&f.t);
        // rate of the chainage at which the IMU is: the derivative of (p − p(s))·t(s) = 0
        let speed = t.speed_at_imu_mps / (1.0 - (at - f.p).dot(&f.k));
        if dt > 0.0 {
            t.accel_mps2 = (speed - t.speed_mps) / dt;
        }
        t.speed_mps = speed;
        t.chainage_m = f.s;
        t.grade_at_imu_rad = libm::asin(f.t.z.clamp(-1.0, 1.0));
        t.pitch_at_imu_rad = libm::asin(s.r[(2, 0)].clamp(-1.0, 1.0));
        t.curvature_vertical_1pm = f.k.dot(&f.u);
        let cos = libm::sqrt((1.0 - f.t.z * f.t.z).max(1e-12));
        t.curvature_horizontal_1pm = f.k.dot(&f.l) / cos;

        let sums = &self.sums;
        t.total_mass_kg = train.total_mass_kg();
        t.load_mass_kg = train.load_mass_kg();
        t.grade_effective_rad = libm::asin((sums.mass_sin / t.total_mass_kg).clamp(-1.0, 1.0));
        t.traction_n = sums.traction_n;
        t.resistance_n = sums.resistance_n;
        t.brake_n = sums.brake_n;
        t.running_resistance = if sums.normal_n > 0.0 {
            sums.resistance_n / sums.normal_n
        } else {
            0.0
        };
        t.balance = Some(self.balance);
        t.off_rail_m = sums.off_rail_m;
        if let Some(sway) = &self.sway {
            let d = states[sway.load].c - states[sway.above].point(&sway.anchor);
            let ahead = states[sway.above].r.column(0).into_owned();
            let flat = Vector3::new(ahead.x, ahead.y, 0.0);
            let flat = flat / flat.norm().max(1e-9);
            let left = Vector3::new(-flat.y, flat.x, 0.0);
            t.sway_rad = [
                libm::atan2(d.dot(&flat), -d.z),
                libm::atan2(d.dot(&left), -d.z),
            ];
        }
        for (out, u) in t.drives.iter_mut().zip(&self.dynamics.drives) {
            let [left, right] = u.wheels;
            let more_left = left.slip.abs() > right.slip.abs();
            let larger = if more_left { left.slip } else { right.slip };
            *out = DriveState {
                chainage_m: u.chainage_m,
                motor_torque_nm: u.motor.torque(),
                wheel_rate_radps: u.wheels.map(|w| w.omega),
                wheel_angle_rad: u.angles,
                traction_n: u.traction_n(),
                slip_mps: larger,
                clamp_mpa: u.clamp.value,
                adhesion: u.adhesion,
            };
        }
        for (out, s) in t.poses.iter_mut().zip(states) {
            *out = (s.p, s.q);
        }
    }
}
