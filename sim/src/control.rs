//! Drive cycle and speed controller. Sees estimates and measurements, never the truth (except where a scenario asks for
//! `feedforward: truth`, an upper limit).

use crate::scenario::{DriveCycle, Pi};
use monorig_estimators::api::signals::{Command, MAX_DRIVES, Vehicle};

/// What the drive cycle asks for now.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reference {
    /// m/s.
    pub speed_mps: f64,
    /// m/s².
    pub accel_mps2: f64,
}

/// What the controller is told about the train.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Perception {
    /// Speed along the rail, m/s.
    pub speed_mps: f64,
    /// Grade for the feed-forward, rad; 0 without one.
    pub grade_rad: f64,
    /// Total mass for the feed-forward, kg; the nominal one without.
    pub total_mass_kg: f64,
    /// Whether grade and mass are known now, and not held or nominal values.
    pub vouched: bool,
    /// Wheel speed of each drive unit minus the speed, m/s: what spins or locks.
    pub slip_mps: [f64; MAX_DRIVES],
}

/// Turns a drive cycle into a reference.
#[derive(Clone, Debug)]
pub struct Cycle {
    points: Vec<(f64, f64)>,
    by_time: bool,
    every_s: Option<f64>,
    accel: f64,
    now: Reference,
}

/// Acceleration limit of the reference when the scenario gives none, m/s².
const ACCEL: f64 = 0.3;

impl Cycle {
    /// A drive cycle from its checked form, starting at `speed`.
    pub fn new(d: &DriveCycle, speed: f64) -> Self {
        let by_time = d.speed.iter().all(|p| p.at_s.is_some());
        let points = d
            .speed
            .iter()
            .map(|p| (p.at_s.or(p.at_m).map_or(0.0, f64::from), p.mps.get()))
            .collect();
        let accel = d
            .accel_mps2
            .map_or(if by_time { f64::INFINITY } else { ACCEL }, f64::from);
        Self {
            points,
            by_time,
            every_s: d.every_s.map(f64::from),
            accel,
            now: Reference {
                speed_mps: speed,
                accel_mps2: 0.0,
            },
        }
    }

    /// The reference at time `t` (s) with the front at chainage `s` (m), `dt` after the last call.
    pub fn at(&mut self, t: f64, s: f64, dt: f64) -> Reference {
        let wish = if self.by_time {
            self.interpolate(self.every_s.map_or(t, |period| libm::fmod(t, period)))
        } else {
            self.allowed(s)
        };
        let before = self.now.speed_mps;
        let step = self.accel * dt;
        let speed = if step.is_finite() {
            before + (wish - before).clamp(-step, step)
        } else {
            wish
        };
        let accel = if dt > 0.0 { (speed - before) / dt } else { 0.0 };
        self.now = Reference {
            speed_mps: speed,
            accel_mps2: accel,
        };
        self.now
    }

    fn interpolate(&self, t: f64) -> f64 {
        let next = self.points.partition_point(|p| p.0 <= t);
        match (
            next.checked_sub(1).and_then(|i| self.points.get(i)),
            self.points.get(next),
        ) {
            (Some(a), Some(b)) => a.1 + (b.1 - a.1) * (t - a.0) / (b.0 - a.0),
            (Some(a), None) => a.1,
            (None, Some(b)) => b.1,
            (None, None) => 0.0,
        }
    }

    /// The speed set for chainage `s`, braked early enough for slower stretches ahead.
    fn allowed(&self, s: f64) -> f64 {
        let next = self.points.partition_point(|p| p.0 <= s);
        let mut v = match next.checked_sub(1) {
            Some(i) => self.points[i].1,
            None => self.points.first().map_or(0.0, |p| p.1),
        };
        for p in &self.points[next..] {
            let reach = libm::sqrt(p.1 * p.1 + 2.0 * self.accel * (p.0 - s).max(0.0));
            v = v.clamp(-reach, reach);
        }
        v
    }
}

/// PI speed control with feed-forward, anti-windup, torque sharing and hold on slopes.
#[derive(Clone, Debug)]
pub struct SpeedController {
    pi: Pi,
    vehicle: Vehicle,
    torque_max: f64,
    clamp_mpa: f64,
    gravity: f64,
    integral: f64,
    holding: bool,
    releasing_s: f64,
    /// Last time: whether grade and mass were known, slow part of the feed-forward N, inertia kg.
    before: (bool, f64, f64),
}

/// Below this speed a train asked to stand is held with the brake, m/s.
const HOLD_SPEED: f64 = 0.01;
/// Overspeed from which the brake helps the motors, and that over which it comes on fully, m/s.
const OVERSPEED: f64 = 0.15;
const OVERSPEED_FULL: f64 = 0.6;
/// Slip from which a drive unit gives up torque, and that over which it gives up all of it, m/s.
const SLIP: f64 = 0.1;
const SLIP_FULL: f64 = 0.4;
/// The brake is released this long after torque was asked for, s: the motors carry the train by then.
const RELEASE_S: f64 = 0.4;

impl SpeedController {
    /// A controller for a vehicle with motors of `torque_max` (N·m each) and clamps at `clamp_mpa` (MPa).
    pub fn new(
        pi: Pi,
        vehicle: Vehicle,
        torque_max: f64,
        clamp_mpa: f64,
        gravity: f64,
        moving: bool,
    ) -> Self {
        Self {
            pi,
            vehicle,
            torque_max,
            clamp_mpa,
            gravity,
            integral: 0.0,
            holding: pi.hold && !moving,
            releasing_s: 0.0,
            before: (false, 0.0, 0.0),
        }
    }

    /// Set the clamp pressure asked for, MPa.
    pub fn set_clamp(&mut self, mpa: f64) {
        self.clamp_mpa = mpa;
    }

    /// The command for the next step of `dt` (s). `emergency` = share of the brake asked for by hand.
    pub fn control(&mut self, r: &Reference, p: &Perception, emergency: f64, dt: f64) -> Command {
        let mut c = Command {
            clamp_pressure_mpa: self.clamp_mpa,
            ..Default::default()
        };
        if emergency > 0.0 {
            self.integral = 0.0;
            c.brake = emergency;
            return c;
        }
        let standing = r.speed_mps == 0.0 && r.accel_mps2 == 0.0 && p.speed_mps.abs() < HOLD_SPEED;
        if self.pi.hold && standing {
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
        let slow = self.pi.feedforward_grade_gain.get() * weight * libm::sin(p.grade_rad)
            + direction * weight * libm::cos(p.grade_rad) * self.vehicle.running_resistance;
        // What the feed-forward takes over, the integral gives up: no jump of torque when an estimate becomes known.
        let (was_known, slow_before, inertia_before) = self.before;
        if p.vouched && !was_known && inertia_before > 0.0 {
            self.integral = (inertia_before * self.integral + slow_before - slow) / inertia;
        }
        self.before = (p.vouched, slow, inertia);
        let ahead = slow + inertia * r.accel_mps2;
        let force = ahead + inertia * (self.pi.kp.get() * error + self.integral);
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
            self.integral += self.pi.ki.get() * error * dt;
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
    use crate::checked::{Finite, NonNegative, Positive};
    use crate::scenario::{FeedForward, SpeedPoint};

    fn cycle(points: &[(f64, f64)], by_time: bool, accel: Option<f64>) -> Cycle {
        let point = |&(at, mps): &(f64, f64)| {
            let at = NonNegative::try_from(at).ok();
            SpeedPoint {
                at_s: at.filter(|_| by_time),
                at_m: at.filter(|_| !by_time),
                mps: Finite::try_from(mps).unwrap(),
            }
        };
        let d = DriveCycle {
            speed: points.iter().map(point).collect(),
            every_s: None,
            accel_mps2: accel.map(|a| Positive::try_from(a).unwrap()),
            controller: Pi::default(),
        };
        Cycle::new(&d, 0.0)
    }

    #[test]
    fn by_time_the_reference_is_linear_between_points_and_its_slope_is_the_acceleration() {
        let mut c = cycle(&[(0.0, 0.0), (2.0, 1.0), (6.0, -1.0)], true, None);
        let mut last = 0.0;
        for k in 1..800 {
            let t = k as f64 * 0.01;
            let r = c.at(t, 0.0, 0.01);
            let expected = if t < 2.0 {
                t / 2.0
            } else {
                (1.0 - (t - 2.0) / 2.0).max(-1.0)
            };
            assert!((r.speed_mps - expected).abs() < 1e-12, "{t}");
            assert!((r.accel_mps2 - (r.speed_mps - last) / 0.01).abs() < 1e-9);
            last = r.speed_mps;
        }
    }

    #[test]
    fn by_chainage_a_slower_stretch_is_reached_at_its_speed_and_the_limit_is_kept() {
        let mut c = cycle(&[(0.0, 2.0), (50.0, 0.5), (70.0, 0.0)], false, Some(0.4));
        let (mut s, mut last, dt) = (0.0, 0.0, 0.002);
        let (mut at_50, mut fastest) = (None, 0.0f64);
        for k in 0..60_000 {
            let r = c.at(k as f64 * dt, s, dt);
            assert!(
                (r.speed_mps - last).abs() <= 0.4 * dt + 1e-12,
                "more than 0.4 m/s² at {s} m"
            );
            last = r.speed_mps;
            fastest = fastest.max(last);
            s += last * dt;
            if s >= 50.0 && at_50.is_none() {
                at_50 = Some(last);
            }
        }
        assert_eq!(fastest, 2.0);
        assert!(at_50.is_some_and(|v| (v - 0.5).abs() < 0.01), "{at_50:?}");
        assert!(
            (s - 70.0).abs() < 0.1 && last < 0.05,
            "stops at {s} m, {last} m/s"
        );
    }

    fn controller() -> SpeedController {
        let vehicle = Vehicle {
            tare_kg: 9000.0,
            drives: 8,
            wheel_radius_m: 0.17,
            gear_ratio: 19.0,
            efficiency: 0.95,
            rotating_mass_kg: 1300.0,
            running_resistance: 0.02,
            mass_range_kg: [5e3, 4e4],
            tare_span_m: [0.0; 2],
            load_span_m: [0.0; 2],
            imu_arm_m: 0.0,
            road: None,
        };
        let pi = Pi {
            feedforward: FeedForward::Truth,
            ..Pi::default()
        };
        SpeedController::new(pi, vehicle, 94.0, 10.0, 9.81, true)
    }

    #[test]
    fn the_feed_forward_alone_carries_slope_resistance_and_acceleration() {
        let r = Reference {
            speed_mps: 1.0,
            accel_mps2: 0.1,
        };
        let p = Perception {
            speed_mps: 1.0,
            grade_rad: 0.1,
            total_mass_kg: 19_000.0,
            ..Default::default()
        };
        let c = controller().control(&r, &p, 0.0, 2e-3);
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
        };
        let stuck = Perception {
            speed_mps: 0.0,
            grade_rad: 0.0,
            total_mass_kg: 29_000.0,
            ..Default::default()
        };
        for _ in 0..50_000 {
            let u = c.control(&r, &stuck, 0.0, 2e-3);
            assert!(u.motor_torque_nm.iter().all(|t| t.abs() <= 94.0));
        }
        // Freed and at its speed, the train is not pushed on by what was piled up meanwhile.
        let freed = Perception {
            speed_mps: 2.05,
            ..stuck
        };
        let u = c.control(&r, &freed, 0.0, 2e-3);
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
        let u = c.control(&stand, &p, 0.0, 2e-3);
        assert_eq!((u.brake, u.motor_torque_nm[0]), (1.0, 0.0));
        let go = Reference {
            speed_mps: 0.1,
            accel_mps2: 0.3,
        };
        let mut released_after = None;
        for k in 0..1000 {
            let u = c.control(&go, &p, 0.0, 2e-3);
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
