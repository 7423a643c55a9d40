//! The radius of the wheels from a log: the way by a reference over the way by the wheels.

use crate::drive::Way;

/// Way of an interval by the wheels, m.
const INTERVAL_M: f64 = 5.0;
/// Fewest intervals.
const MIN_INTERVALS: usize = 4;

/// The way by the wheels at each sample of the reference.
pub(crate) struct Rolled {
    way: Way,
    next: usize,
    rolled_m: f64,
    last: Option<(i64, f64)>,
    segment: u32,
    marks: Vec<Mark>,
}

/// A sample of the reference, with the way by the wheels until then.
#[derive(Clone, Copy, Debug)]
struct Mark {
    t_ns: i64,
    way_m: f64,
    rolled_m: f64,
    /// Stretch of the reference and segment of the log: no interval goes beyond one.
    within: (u32, u32),
}

impl Rolled {
    /// Beside this reference.
    pub fn new(way: Way) -> Self {
        Self {
            way,
            next: 0,
            rolled_m: 0.0,
            last: None,
            segment: 0,
            marks: Vec::new(),
        }
    }

    /// A step that ends at `t_ns` with this speed of the wheels (m/s), which is linear over it.
    pub fn see(&mut self, t_ns: i64, segment: u32, speed_mps: f64) {
        if !speed_mps.is_finite() {
            return;
        }
        let begins = self.last.filter(|_| segment == self.segment);
        self.segment = segment;
        let (from_ns, from_mps) = begins.unwrap_or((t_ns, speed_mps));
        let step_s = (t_ns - from_ns) as f64 * 1e-9;
        while let Some(&(mark_ns, way_m, stretch)) = self.way.samples.get(self.next) {
            if mark_ns > t_ns {
                break;
            }
            self.next += 1;
            if mark_ns < from_ns {
                continue; // before the log, or in one of its gaps
            }
            let after_s = (mark_ns - from_ns) as f64 * 1e-9;
            let share = if step_s > 0.0 { after_s / step_s } else { 0.0 };
            let speed = from_mps + share * (speed_mps - from_mps);
            self.marks.push(Mark {
                t_ns: mark_ns,
                way_m,
                rolled_m: self.rolled_m + 0.5 * (from_mps + speed) * after_s,
                within: (stretch, segment),
            });
        }
        self.rolled_m += 0.5 * (from_mps + speed_mps) * step_s;
        self.last = Some((t_ns, speed_mps));
    }

    /// The way by the reference over that by the wheels, and its standard deviation; none of fewer than four intervals
    /// of 5 m.
    pub fn ratio(&self) -> Option<(f64, f64)> {
        let mut rows: Vec<(f64, f64, f64)> = Vec::new();
        let mut from: Option<&Mark> = None;
        for mark in &self.marks {
            let Some(begin) = from.filter(|m| m.within == mark.within) else {
                from = Some(mark);
                continue;
            };
            let rolled = mark.rolled_m - begin.rolled_m;
            if rolled.abs() >= INTERVAL_M {
                let time_s = (mark.t_ns - begin.t_ns) as f64 * 1e-9;
                rows.push((rolled, mark.way_m - begin.way_m, time_s));
                from = Some(mark);
            }
        }
        if rows.len() < MIN_INTERVALS {
            return None;
        }
        let sum = |of: &dyn Fn(&(f64, f64, f64)) -> f64| rows.iter().map(of).sum::<f64>();
        let squares = sum(&|(rolled, ..)| rolled * rolled);
        let ratio = sum(&|(rolled, way, _)| rolled * way) / squares;
        let off = sum(&|(rolled, way, _)| (way - ratio * rolled).powi(2));
        let residual = (off / (rows.len() - 1) as f64 / squares).sqrt();
        // of each sample of a distance both ends of an interval; of a speed one error of all of them
        let marks = (2.0 / squares).sqrt() * self.way.sd_m;
        let constant = self.way.speed_sd_mps * sum(&|(rolled, _, t)| rolled * t).abs() / squares;
        Some((ratio, residual.max(marks).hypot(constant)))
    }
}
