//! Drive cycle: the speed reference by time or by chainage.

use monorig_estimators::api::signals::Command;

/// Reference of the controller: speed by the drive cycle, brake and clamp pressure by the events of the scenario.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Reference {
    /// Speed, m/s.
    pub speed_mps: f64,
    /// Acceleration, m/s².
    pub accel_mps2: f64,
    /// Emergency brake: share of the brake force, 0 = none.
    pub emergency_brake: f64,
    /// Commanded clamp pressure, MPa.
    pub clamp_pressure_mpa: f64,
}

impl Reference {
    /// Command without torque that keeps the reference's clamp pressure and emergency brake: where a controller starts
    /// from.
    pub fn command(&self) -> Command {
        Command {
            clamp_pressure_mpa: self.clamp_pressure_mpa,
            brake: self.emergency_brake,
            ..Command::default()
        }
    }
}

/// Speed reference from a drive cycle: rate-limited interpolation of its points.
#[derive(Clone, Debug)]
pub struct Cycle {
    /// Time, s, or chainage, m; and speed, m/s.
    points: Vec<(f64, f64)>,
    by_time: bool,
    every_s: Option<f64>,
    accel: f64,
    speed: f64,
}

/// Acceleration limit of the reference when the scenario gives none, m/s².
const ACCEL: f64 = 0.3;

impl Cycle {
    /// Starts at `speed` (m/s). The points are times (s) and speeds (m/s), linear in between; they start over every
    /// `every_s` (s) if it is given. The reference changes by at most `accel_mps2` (m/s²).
    pub fn by_time(
        points: Vec<(f64, f64)>,
        every_s: Option<f64>,
        accel_mps2: Option<f64>,
        speed: f64,
    ) -> Self {
        Self {
            points,
            by_time: true,
            every_s,
            accel: accel_mps2.unwrap_or(f64::INFINITY),
            speed,
        }
    }

    /// Starts at `speed` (m/s). The points are chainages (m) and speeds (m/s), held from point to point and approached
    /// within `accel_mps2` (m/s²).
    pub fn by_chainage(points: Vec<(f64, f64)>, accel_mps2: Option<f64>, speed: f64) -> Self {
        Self {
            points,
            by_time: false,
            every_s: None,
            accel: accel_mps2.unwrap_or(ACCEL),
            speed,
        }
    }

    /// The reference at time `t` (s) with the front at chainage `s` (m), `dt` after the last call.
    pub fn at(&mut self, t: f64, s: f64, dt: f64) -> Reference {
        let target = if self.by_time {
            self.interpolate(self.every_s.map_or(t, |period| libm::fmod(t, period)))
        } else {
            self.allowed(s)
        };
        let before = self.speed;
        let step = self.accel * dt;
        let speed = if step.is_finite() {
            before + (target - before).clamp(-step, step)
        } else {
            target
        };
        let accel = if dt > 0.0 { (speed - before) / dt } else { 0.0 };
        self.speed = speed;
        Reference {
            speed_mps: speed,
            accel_mps2: accel,
            ..Reference::default()
        }
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

    /// Reference speed at chainage `s`, reduced early enough for slower stretches ahead.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_time_the_reference_is_linear_between_points_and_its_slope_is_the_acceleration() {
        let points = vec![(0.0, 0.0), (2.0, 1.0), (6.0, -1.0)];
        let mut c = Cycle::by_time(points, None, None, 0.0);
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
        let points = vec![(0.0, 2.0), (50.0, 0.5), (70.0, 0.0)];
        let mut c = Cycle::by_chainage(points, Some(0.4), 0.0);
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
}
