//! Drive cycle and speed controller. Sees estimates and measurements, never the truth (except where a scenario asks for
//! `feedforward: truth`, an upper limit).

use crate::scenario::{DriveCycle, Pi};
use monorig_estimators::signals::{Command, MAX_DRIVES, Vehicle};

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
}

/// Turns a drive cycle into a reference.
#[derive(Clone, Debug)]
pub struct Cycle {
    points: Vec<(f64, f64)>,
    by_time: bool,
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
            self.interpolate(t)
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
}

/// Below this speed a train asked to stand is held with the brake, m/s.
const HOLD_SPEED: f64 = 0.01;
/// Overspeed from which the brake helps the motors, and that over which it comes on fully, m/s.
const OVERSPEED: f64 = 0.15;
const OVERSPEED_FULL: f64 = 0.6;
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
        let ahead = weight * libm::sin(p.grade_rad)
            + direction * weight * libm::cos(p.grade_rad) * self.vehicle.running_resistance
            + inertia * r.accel_mps2;
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
        for t in c.motor_torque_nm.iter_mut().take(v.drives.min(MAX_DRIVES)) {
            *t = limited;
        }
        // Downhill the motors alone may not hold the train: the brake takes what is too fast.
        let overspeed = p.speed_mps.abs() - r.speed_mps.abs();
        let service = ((overspeed - OVERSPEED) / OVERSPEED_FULL).clamp(0.0, 1.0);
        c.brake = if self.holding { 1.0 } else { service };
        c
    }
}
