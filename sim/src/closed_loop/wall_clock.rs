//! The wall clock of a run in real time: the pace of the run and the estimators outside of the program keep to one.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// A wall clock with a factor: simulated seconds per second.
#[derive(Debug)]
pub struct WallClock {
    times_real: f64,
    /// Instant of the simulation's start; `None` before a run.
    origin: Mutex<Option<Instant>>,
}

impl PartialEq for WallClock {
    /// Two clocks are equal if they have the same rate.
    fn eq(&self, other: &Self) -> bool {
        self.times_real == other.times_real
    }
}

impl WallClock {
    /// Makes a clock with this number of simulated seconds in a second: 1 is real time.
    pub fn new(times_real: f64) -> Self {
        Self {
            times_real,
            origin: Mutex::default(),
        }
    }

    /// Simulated seconds a second.
    pub fn times_real(&self) -> f64 {
        self.times_real
    }

    /// Sets the clock to this time of the simulation, s.
    pub fn set(&self, t_s: f64) {
        let origin = Instant::now().checked_sub(self.length(t_s));
        *self.origin.lock().unwrap_or_else(PoisonError::into_inner) = origin;
    }

    /// Forgets the previous run.
    pub fn clear(&self) {
        *self.origin.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }

    /// Returns the instant at which the simulation is due at this time, s; the first call starts the clock.
    pub fn due(&self, t_s: f64) -> Instant {
        let known = *self.origin.lock().unwrap_or_else(PoisonError::into_inner);
        match known {
            Some(origin) => origin + self.length(t_s),
            None => {
                self.set(t_s);
                Instant::now()
            }
        }
    }

    fn length(&self, t_s: f64) -> Duration {
        Duration::from_secs_f64((t_s / self.times_real).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_due_follows_the_rate() {
        let clock = WallClock::new(4.0);
        clock.set(10.0);
        let (a, b) = (clock.due(10.0), clock.due(12.0));
        assert_eq!(b - a, Duration::from_millis(500));
        assert!(a <= Instant::now() && a + Duration::from_secs(1) > Instant::now());
        clock.clear();
        assert!(clock.due(3.0) >= a, "it begins anew");
    }
}
