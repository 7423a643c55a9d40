//! Speed controller: PI control with feed-forward, anti-windup, torque sharing and hold on slopes.

use super::{Controller, ControllerSetup, Perception, Reference};
use monorig_estimators::api::signals::{Command, Vehicle};

monorig_estimators::params! {
    /// Parameters of the PI speed controller.
    SpeedControllerParams {
        kp ["1/s"] = 1.5, 0.0 => 1e3, "Proportional gain: acceleration asked per m/s of speed error.";
        ki ["1/s²"] = 0.5, 0.0 => 1e3, "Integral gain.";
        feedforward_grade_gain ["-"] = 1.0, -10.0 => 10.0, "Factor on the slope's part of the feed-forward: 1 is right, -1 is a wrong sign. A fault to inject.";
        hold [flag] = true, "Hold the train with the brake when the reference is zero and the train stands.";
    }
}

/// PI speed control with feed-forward, anti-windup, torque sharing and hold on slopes.
#[derive(Clone, Debug)]
pub struct SpeedController {
    params: SpeedControllerParams,
    vehicle: Vehicle,
    torque_max: f64,
    gravity: f64,
    integral: f64,
    holding: bool,
    releasing_s: f64,
    /// Last time: whether grade and mass were known, slow part of the feed-forward N, inertia kg.
    before: (bool, f64, f64),
}

/// Below this speed a train asked to stand is held with the brake, m/s.
const HOLD_SPEED: f64 = 0.01;
/// Overspeed from which the brake helps the motors, and further overspeed up to the full brake, m/s.
const OVERSPEED: f64 = 0.15;
const OVERSPEED_FULL: f64 = 0.6;
/// Slip from which a drive unit reduces its torque, and further slip up to zero torque, m/s.
const SLIP: f64 = 0.1;
const SLIP_FULL: f64 = 0.4;
/// Time from the torque command to the release of the brake, s: the motors carry the train by then.
const RELEASE_S: f64 = 0.4;

impl SpeedController {
    /// A controller for this nominal vehicle.
    pub fn new(params: SpeedControllerParams, vehicle: Vehicle, setup: &ControllerSetup) -> Self {
        Self {
            params,
            vehicle,
            torque_max: setup.motor_torque_max_nm,
            gravity: setup.gravity_mps2,
            integral: 0.0,
            holding: params.hold && setup.start_speed_mps == 0.0,
            releasing_s: 0.0,
            before: (false, 0.0, 0.0),
        }
    }
}

impl Controller for SpeedController {
    fn control(&mut self, r: &Reference, p: &Perception, dt: f64) -> Command {
        let mut c = r.command();
        if r.emergency_brake > 0.0 {
            self.integral = 0.0;
            return c;
        }
        let standing = r.speed_mps == 0.0 && r.accel_mps2 == 0.0 && p.speed_mps.abs() < HOLD_SPEED;
        if self.params.hold && standing {
            self.holding = true;
            self.releasing_s = RELEASE_S;
        }
        if self.holding && r.speed_mps == 0.0 && r.accel_mps2 == 0.0 {
            self.integral = 0.0;
            c.brake = 1.0;
            return c;
        }
        if self.holding {
            // Start: torque first, then the brake goes.
            self.releasing_s -= dt;
            if self.releasing_s <= 0.0 {
                self.holding = false;
            }
        }

        let inertia = p.total_mass_kg + self.vehicle.rotating_mass_kg;
        let error = r.speed_mps - p.speed_mps;
        let weight = p.total_mass_kg * self.gravity;
        let direction = if r.speed_mps == 0.0 {
            0.0
        } else {
            r.speed_mps.signum()
        };
        let slow = self.params.feedforward_grade_gain * weight * libm::sin(p.grade_rad)
            + direction * weight * libm::cos(p.grade_rad) * self.vehicle.running_resistance;
        // What the feed-forward takes over, the integral gives up: no jump of torque when an estimate becomes known.
        let (was_known, slow_before, inertia_before) = self.before;
        if p.valid && !was_known && inertia_before > 0.0 {
            self.integral = (inertia_before * self.integral + slow_before - slow) / inertia;
        }
        self.before = (p.valid, slow, inertia);
        let ahead = slow + inertia * r.accel_mps2;
        let force = ahead + inertia * (self.params.kp * error + self.integral);
        let v = &self.vehicle;
        let efficiency = if force * p.speed_mps >= 0.0 {
            v.efficiency
        } else {
            1.0 / v.efficiency
        };
        let drives = v.drives.max(1) as f64;
        let torque = force * v.wheel_radius_m / (v.gear_ratio * efficiency * drives);
        let limited = torque.clamp(-self.torque_max, self.torque_max);
        // Anti-windup: integrate only while the limit does not act, or to leave it.
        if !self.holding && (limited == torque || (torque - limited) * error < 0.0) {
            self.integral += self.params.ki * error * dt;
        }
        for (t, slip) in c.motor_torque_nm.iter_mut().zip(&p.slip_mps).take(v.drives) {
            // A unit whose wheels run away under its torque gives some of it up.
            let away = slip * limited.signum();
            *t = limited * (1.0 - ((away - SLIP) / SLIP_FULL).clamp(0.0, 1.0));
        }
        // Downhill the motors alone may not hold the train: the brake takes what is too fast.
        let overspeed = p.speed_mps.abs() - r.speed_mps.abs();
        let service = ((overspeed - OVERSPEED) / OVERSPEED_FULL).clamp(0.0, 1.0);
        c.brake = if self.holding { 1.0 } else { service };
        c
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::vehicle;

    fn controller() -> SpeedController {
        let setup = ControllerSetup {
            motor_torque_max_nm: 94.0,
            gravity_mps2: 9.81,
            start_speed_mps: 1.0,
        };
        SpeedController::new(SpeedControllerParams::default(), vehicle(), &setup)
    }

    #[test]
    fn the_feed_forward_alone_carries_slope_resistance_and_acceleration() {
        let r = Reference {
            speed_mps: 1.0,
            accel_mps2: 0.1,
            ..Reference::default()
        };
        let p = Perception {
            speed_mps: 1.0,
            grade_rad: 0.1,
            total_mass_kg: 19_000.0,
            ..Default::default()
        };
        let c = controller().control(&r, &p, 2e-3);
        let rim: f64 = c.motor_torque_nm.iter().sum::<f64>() * 19.0 * 0.95 / 0.17;
        let (sin, cos) = (0.1f64.sin(), 0.1f64.cos());
        let expected = 19_000.0 * 9.81 * (sin + 0.02 * cos) + 20_300.0 * 0.1;
        assert!(
            (rim / expected - 1.0).abs() < 1e-12,
            "{rim} against {expected}"
        );
    }

    #[test]
    fn the_integral_does_not_wind_up_against_the_torque_limit() {
        let mut c = controller();
        let r = Reference {
            speed_mps: 2.0,
            accel_mps2: 0.0,
            ..Reference::default()
        };
        let stuck = Perception {
            speed_mps: 0.0,
            grade_rad: 0.0,
            total_mass_kg: 29_000.0,
            ..Default::default()
        };
        for _ in 0..50_000 {
            let u = c.control(&r, &stuck, 2e-3);
            assert!(u.motor_torque_nm.iter().all(|t| t.abs() <= 94.0));
        }
        // Freed and at its speed, the train is not pushed on by what was piled up meanwhile.
        let freed = Perception {
            speed_mps: 2.05,
            ..stuck
        };
        let u = c.control(&r, &freed, 2e-3);
        assert!(u.motor_torque_nm[0] < 94.0, "{}", u.motor_torque_nm[0]);
    }

    #[test]
    fn a_standing_train_is_held_and_started_with_torque_before_the_brake_goes() {
        let mut c = controller();
        let stand = Reference::default();
        let p = Perception {
            speed_mps: 0.0,
            grade_rad: 0.2,
            total_mass_kg: 19_000.0,
            ..Default::default()
        };
        let u = c.control(&stand, &p, 2e-3);
        assert_eq!((u.brake, u.motor_torque_nm[0]), (1.0, 0.0));
        let go = Reference {
            speed_mps: 0.1,
            accel_mps2: 0.3,
            ..Reference::default()
        };
        let mut released_after = None;
        for k in 0..1000 {
            let u = c.control(&go, &p, 2e-3);
            assert!(u.motor_torque_nm[0] > 0.0, "torque from the first step on");
            if u.brake == 0.0 && released_after.is_none() {
                released_after = Some(k as f64 * 2e-3);
            }
        }
        assert!(
            released_after.is_some_and(|t| (0.3..0.5).contains(&t)),
            "{released_after:?}"
        );
    }
}
