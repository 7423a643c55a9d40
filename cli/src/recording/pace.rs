//! Pace: holds a run to the clock, so that it can be watched as it goes.

use monorig_sim::closed_loop::run::{Observer, StepFrame};
use monorig_sim::error::Error;
use std::time::{Duration, Instant};

/// An observer that waits until the clock has come to where the simulation is: 1 = real time, 2 = twice as fast. A run
/// that is slower than this does not wait.
pub struct Pace {
    times_real: f64,
    begun: Option<Instant>,
}

/// Waits shorter than this are left for later: a system cannot keep them, s.
const LEAST_WAIT_S: f64 = 0.002;

impl Pace {
    /// So many simulated seconds a second.
    pub fn new(times_real: f64) -> Self {
        Self {
            times_real,
            begun: None,
        }
    }
}

impl Observer for Pace {
    fn on_step(&mut self, frame: &StepFrame<'_>) -> Result<(), Error> {
        let begun = self.begun.get_or_insert_with(Instant::now);
        let due_s = frame.time_ns as f64 * 1e-9 / self.times_real;
        let wait_s = due_s - begun.elapsed().as_secs_f64();
        if wait_s > LEAST_WAIT_S {
            std::thread::sleep(Duration::from_secs_f64(wait_s));
        }
        Ok(())
    }
}

/// A pace as a number above zero.
pub fn parse(text: &str) -> Result<f64, String> {
    let pace = text
        .parse::<f64>()
        .ok()
        .filter(|x| (0.01..=1000.0).contains(x));
    pace.ok_or_else(|| "write how many times real time, from 0.01 to 1000, such as 1".to_owned())
}
