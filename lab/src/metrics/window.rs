//! Windows of time whose ends may be moments that are known only when the run reaches them.

use crate::metrics::series::{ErrorSample, Geometry, Tracking};
use crate::metrics::statistics::Running;
use monorig_sim::config::scenario::{Moment, MomentOf, ScenarioFile, VehiclePart};
use std::collections::VecDeque;

/// A stretch of time, both ends included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Window {
    after: End,
    until: End,
}

/// An end of a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum End {
    /// An instant, s.
    At(f64),
    /// `plus_s` (s) after the IMU has first come to chainage `imu_m` (m), at `passed_s` (s) if it has.
    Passing {
        imu_m: f64,
        /// s; negative = before.
        plus_s: f64,
        passed_s: Option<f64>,
    },
}

impl End {
    /// Makes the end from a moment of the scenario; a moment that is not found is never reached.
    pub(crate) fn of(moment: &Moment, file: &ScenarioFile, geometry: &Geometry) -> Self {
        match moment.find(file, &geometry.places) {
            Err(_) => Self::At(f64::INFINITY),
            Ok(MomentOf::Instant(t_s)) => Self::At(t_s),
            Ok(MomentOf::Passing(part, at_m, plus_s)) => {
                let imu_from_part_m = match part {
                    VehiclePart::Front => geometry.imu_offset_m,
                    VehiclePart::Imu => 0.0,
                    VehiclePart::Rear => geometry.imu_offset_m + geometry.length_m,
                };
                Self::Passing {
                    imu_m: at_m + imu_from_part_m,
                    plus_s,
                    passed_s: None,
                }
            }
        }
    }

    /// Instant, s; infinite if the run has not reached it.
    pub(crate) fn instant_s(self) -> f64 {
        match self {
            Self::At(t_s) => t_s,
            Self::Passing {
                plus_s, passed_s, ..
            } => passed_s.map_or(f64::INFINITY, |t_s| t_s + plus_s),
        }
    }

    fn see(&mut self, x: &Tracking) {
        if let Self::Passing {
            imu_m,
            passed_s: passed @ None,
            ..
        } = self
            && x.chainage >= *imu_m
        {
            *passed = Some(x.t_s);
        }
    }

    /// Delay until an instant is known to be before or after this end, s.
    fn known_after_s(self) -> f64 {
        match self {
            Self::At(_) => 0.0,
            Self::Passing { plus_s, .. } => (-plus_s).max(0.0),
        }
    }
}

impl Window {
    /// Makes a window from one instant to another, s.
    pub(crate) fn new(after_s: f64, until_s: f64) -> Self {
        Self::between(End::At(after_s), End::At(until_s))
    }

    /// Makes a window between two ends.
    pub(crate) fn between(after: End, until: End) -> Self {
        Self { after, until }
    }

    /// Begin of the window, s; infinite if the run does not reach it.
    pub(crate) fn after_s(&self) -> f64 {
        self.after.instant_s()
    }

    /// End of the window, s; infinite if the run does not reach it.
    pub(crate) fn until_s(&self) -> f64 {
        self.until.instant_s()
    }

    /// True if this instant (s) is inside the window, by the ends known so far.
    pub(crate) fn holds(&self, t_s: f64) -> bool {
        t_s >= self.after_s() && t_s <= self.until_s()
    }

    /// Checks if the run has reached an end of the window.
    pub(crate) fn see(&mut self, x: &Tracking) {
        self.after.see(x);
        self.until.see(x);
    }
}

/// A sample with an instant.
pub(super) trait Timed: Copy {
    fn t_s(&self) -> f64;
}

impl Timed for ErrorSample {
    fn t_s(&self) -> f64 {
        self.t_s
    }
}

impl Timed for Tracking {
    fn t_s(&self) -> f64 {
        self.t_s
    }
}

/// A number made of the samples in a window. Samples wait where an end may turn out to have been before them
/// (`plus_s: -3`).
pub(super) struct Windowed<T> {
    pub(crate) window: Window,
    running: Running<T>,
    known_after_s: f64,
    waiting: VecDeque<T>,
}

impl<T: Timed> Windowed<T> {
    pub(crate) fn new(window: Window, running: Running<T>) -> Self {
        let known_after_s = window.after.known_after_s();
        Self {
            window,
            running,
            known_after_s: known_after_s.max(window.until.known_after_s()),
            waiting: VecDeque::new(),
        }
    }

    /// Samples, and the states of the run at their instants.
    pub(crate) fn add_all(&mut self, tracking: &[Tracking], xs: &[T]) {
        let known = |end| !matches!(end, End::Passing { passed_s: None, .. });
        if known(self.window.after) && known(self.window.until) && self.waiting.is_empty() {
            let from = xs.partition_point(|x| x.t_s() < self.window.after_s());
            let until = xs.partition_point(|x| x.t_s() <= self.window.until_s());
            return self.running.add_all(&xs[from.min(until)..until]);
        }
        for (t, x) in tracking.iter().zip(xs) {
            self.window.see(t);
            self.waiting.push_back(*x);
            let known_s = t.t_s - self.known_after_s;
            while let Some(x) = self.waiting.pop_front_if(|x| x.t_s() <= known_s) {
                self.count(&x);
            }
        }
    }

    /// The run is over: what waits is counted.
    pub(crate) fn finish(&mut self) {
        for x in std::mem::take(&mut self.waiting) {
            self.count(&x);
        }
    }

    pub(crate) fn value(&self) -> f64 {
        self.running.value()
    }

    fn count(&mut self, x: &T) {
        if self.window.holds(x.t_s()) {
            self.running.add(x);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::statistics::mean;
    use monorig_sim::rail::Place;
    use serde_json::json;

    /// A train 18 m long, its IMU 4 m behind its front, at 2 m/s from a front at 20 m, seen each half second of 20 s.
    fn at(i: u32) -> Tracking {
        Tracking {
            t_s: 0.5 * f64::from(i),
            chainage: 16.0 + f64::from(i),
            ..Default::default()
        }
    }

    fn end(moment: serde_json::Value) -> End {
        let file: ScenarioFile = serde_json::from_value(json!({
            "version": 1, "why": "w", "track": "t", "train": "t", "sensors": "s", "stop": {"after_s": 60},
            "drive": {"speed": [{"at_s": 0, "mps": 2}]}
        }))
        .unwrap();
        let geometry = Geometry {
            places: vec![Place {
                name: "climb".into(),
                from_m: 30.0,
                to_m: 34.0,
            }],
            imu_offset_m: -4.0,
            length_m: 18.0,
        };
        End::of(&serde_json::from_value(moment).unwrap(), &file, &geometry)
    }

    /// Front, IMU and rear come to 30 m at 5, 7 and 14 s.
    #[test]
    fn parts_of_the_vehicle_pass_a_place_one_after_the_other() {
        let instant_s = |moment: serde_json::Value, steps: u32| {
            let mut window = Window::between(end(moment), End::At(f64::INFINITY));
            (0..steps).for_each(|i| window.see(&at(i)));
            window.after_s()
        };
        assert_eq!(instant_s(json!({"front_enters": "climb"}), 40), 5.0);
        assert_eq!(instant_s(json!({"imu_enters": "climb"}), 40), 7.0);
        assert_eq!(instant_s(json!({"rear_enters": "climb"}), 40), 14.0);
        let later = json!({"front_leaves": "climb", "plus_s": 1.5});
        assert_eq!(instant_s(later, 40), 8.5);
        // the run ends before
        let rear = json!({"rear_enters": "climb"});
        assert_eq!(instant_s(rear, 20), f64::INFINITY);
        assert_eq!(
            instant_s(json!({"imu_enters": "nowhere"}), 40),
            f64::INFINITY
        );
    }

    /// The mean time of a window gives both its ends: what counts is what `between` of the whole series gives, also
    /// where an end lies seconds before the moment that it is known by, and where the run ends meanwhile.
    #[test]
    fn samples_count_as_if_the_ends_had_been_known_from_the_start() {
        let imu = |plus_s: f64| end(json!({"imu_enters": "climb", "plus_s": plus_s}));
        let front = |plus_s: f64| end(json!({"front_enters": "climb", "plus_s": plus_s}));
        for (after, until, steps) in [
            (front(0.0), imu(0.0), 40),
            (front(-3.0), imu(-2.5), 40),
            (imu(-6.9), End::At(f64::INFINITY), 40),
            (End::At(1.0), imu(-4.0), 40),
            (End::At(1.0), imu(-4.0), 13),
            (imu(-7.0), imu(3.0), 18),
            (imu(2.0), imu(-2.0), 40),
        ] {
            let mut windowed =
                Windowed::new(Window::between(after, until), mean(|x: &Tracking| x.t_s));
            let all: Vec<Tracking> = (0..steps).map(at).collect();
            windowed.add_all(&all, &all);
            windowed.finish();
            let inside = all.iter().filter(|x| windowed.window.holds(x.t_s));
            let inside: Vec<f64> = inside.map(|x| x.t_s).collect();
            let expected = inside.iter().sum::<f64>() / inside.len() as f64;
            let value = windowed.value();
            let same = value == expected || value.is_nan() && inside.is_empty();
            assert!(same, "{after:?} {until:?}: {value} against {expected}");
        }
    }
}
