//! Channels of a log over time: the samples that were accepted, linear between neighbours, and unknown where there are
//! none. A sample that `valid_if` rejects is none, and no older one stands for it.

use crate::drive::Step;
use monorig_estimators::api::signals::{MAX_DRIVES, Vehicle};

/// A gap up to this is bridged in a fast channel, ns.
const SHORT_NS: i64 = 200_000_000;
/// A gap up to so many usual intervals is bridged in a slow one.
const INTERVALS: f64 = 2.5;

/// Longest gap that is bridged in a channel with this usual interval, ns.
pub(super) fn longest_gap_ns(interval_ns: i64) -> i64 {
    SHORT_NS.max((INTERVALS * interval_ns as f64) as i64)
}

/// Samples of one channel in the order of time.
#[derive(Clone, Debug, Default)]
pub(crate) struct Track {
    samples: Vec<(i64, f64)>,
    /// Usual interval.
    interval_ns: i64,
    next: usize,
}

impl Track {
    fn push(&mut self, t_ns: i64, x: f64) {
        if self.samples.last().is_none_or(|(last, _)| *last < t_ns) {
            self.samples.push((t_ns, x));
        }
    }

    /// Finds the usual interval, the median, which says how long a gap may be.
    fn settle(&mut self) {
        let pairs = self.samples.windows(2);
        let mut steps: Vec<i64> = pairs
            .filter_map(|w| Some(w.get(1)?.0 - w.first()?.0))
            .collect();
        let middle = steps.len() / 2;
        self.interval_ns = match steps.is_empty() {
            true => 0,
            false => *steps.select_nth_unstable(middle).1,
        };
        self.next = 0;
    }

    /// The value at a time, which must not fall from call to call; not a number in a gap.
    pub fn at(&mut self, t_ns: i64) -> f64 {
        while self.samples.get(self.next).is_some_and(|(t, _)| *t < t_ns) {
            self.next += 1;
        }
        let before = self.next.checked_sub(1).and_then(|i| self.samples.get(i));
        match (before, self.samples.get(self.next)) {
            (_, Some((t, x))) if *t == t_ns => *x,
            (Some((t0, x0)), Some((t1, x1))) if t1 - t0 <= longest_gap_ns(self.interval_ns) => {
                x0 + (x1 - x0) * ((t_ns - t0) as f64 / (t1 - t0) as f64)
            }
            _ => f64::NAN,
        }
    }

    /// True without a sample.
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }
}

/// The channels of the force balance over a stretch of a log.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tracks {
    /// Ends of the steps, ns of the replay.
    pub times_ns: Vec<i64>,
    /// True in a step in which the brake was asked for.
    pub braked: Vec<bool>,
    /// Specific force, m/s², and angular rate, rad/s, in the axes of the vehicle.
    pub force: [Track; 3],
    pub rate: [Track; 3],
    wheels: Vec<Track>,
    torques: Vec<Track>,
}

impl Tracks {
    /// Takes a step.
    pub fn see(&mut self, step: &Step) {
        self.times_ns.push(step.t_ns);
        self.braked.push(step.brake > 0.0);
        let z = &step.z;
        for (tracks, sample) in [
            (&mut self.force, z.specific_force_mps2),
            (&mut self.rate, z.angular_rate_radps),
        ] {
            if let Some(s) = sample {
                for (track, x) in tracks.iter_mut().zip(s.value) {
                    track.push(s.t.ns(), x);
                }
            }
        }
        for (tracks, slots) in [
            (&mut self.wheels, &z.wheel_speed_mps),
            (&mut self.torques, &z.motor_torque_nm),
        ] {
            if tracks.is_empty() {
                tracks.resize_with(MAX_DRIVES, Track::default);
            }
            for (track, sample) in tracks.iter_mut().zip(slots) {
                if let Some(s) = sample {
                    track.push(s.t.ns(), s.value);
                }
            }
        }
    }

    /// All samples are there: values can be asked for, from the first time on.
    pub fn settle(&mut self) {
        self.wheels.retain(|t| !t.is_empty());
        self.torques.retain(|t| !t.is_empty());
        let imu = self.force.iter_mut().chain(&mut self.rate);
        imu.chain(&mut self.wheels)
            .chain(&mut self.torques)
            .for_each(Track::settle);
    }

    /// Usual interval of the slowest channel of the force balance, s.
    pub fn slowest_s(&self) -> f64 {
        let channels = self.wheels.iter().chain(&self.torques).chain(&self.force);
        channels.map(|t| t.interval_ns).max().unwrap_or(0) as f64 * 1e-9
    }

    /// Mean speed of the wheels, m/s; not a number where one of them is not known.
    pub fn speed_at(&mut self, t_ns: i64) -> f64 {
        let n = self.wheels.len() as f64;
        self.wheels.iter_mut().map(|w| w.at(t_ns)).sum::<f64>() / n
    }

    /// Force of the motors at the rims as the nominal vehicle has it at this speed, N; not a number where a torque is
    /// not known.
    pub fn force_at(&mut self, t_ns: i64, speed: f64, vehicle: &Vehicle) -> f64 {
        if self.torques.is_empty() {
            return f64::NAN;
        }
        let torques = self.torques.iter_mut();
        torques.map(|t| rim_force(t.at(t_ns), speed, vehicle)).sum()
    }
}

/// Force at the rims of a torque at the motor, N: what is lost in the gear is lost on the way of the power.
pub(super) fn rim_force(torque: f64, speed: f64, v: &Vehicle) -> f64 {
    let ideal = torque * v.gear_ratio / v.wheel_radius_m;
    match torque * speed >= 0.0 {
        true => ideal * v.efficiency,
        false => ideal / v.efficiency,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Linear between samples a twentieth of a second apart, nothing in a gap of one second, and nothing at the ends.
    #[test]
    fn a_gap_is_no_value() {
        let mut track = Track::default();
        let ms = |t: i64| t * 1_000_000;
        for t in (0..=1000).step_by(50).chain((2000..=3000).step_by(50)) {
            track.push(ms(t), t as f64);
        }
        track.settle();
        assert!(track.at(ms(-1)).is_nan());
        assert_eq!(track.at(ms(125)), 125.0);
        assert_eq!(track.at(ms(1000)), 1000.0);
        assert!(track.at(ms(1010)).is_nan() && track.at(ms(1999)).is_nan());
        assert_eq!(track.at(ms(2000)), 2000.0);
        assert!(track.at(ms(3001)).is_nan());
    }
}
