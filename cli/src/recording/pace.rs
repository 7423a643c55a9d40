//! Pace: slows a run down to the clock, so that a user can watch it.

use monorig_sim::closed_loop::run::{Observer, StepFrame};
use monorig_sim::closed_loop::{Simulation, WallClock};
use monorig_sim::error::Error;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Observer that waits until the clock has reached the time of the simulation: 1 = real time, 2 = twice as fast. A run
/// that is slower than this does not wait.
pub struct Pace {
    clock: Arc<WallClock>,
}

/// Shortest wait: a system cannot keep shorter waits, so these are added to a later one.
const LEAST_WAIT: Duration = Duration::from_micros(200);

impl Pace {
    /// Makes a pace with this clock.
    pub fn new(clock: Arc<WallClock>) -> Self {
        Self { clock }
    }
}

impl Observer for Pace {
    fn begin(&mut self, _: &Simulation) -> Result<(), Error> {
        self.clock.clear();
        Ok(())
    }

    fn on_step(&mut self, frame: &StepFrame<'_>) -> Result<(), Error> {
        let due = self.clock.due(frame.time_ns as f64 * 1e-9);
        let wait = due.saturating_duration_since(Instant::now());
        if wait > LEAST_WAIT {
            std::thread::sleep(wait);
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
