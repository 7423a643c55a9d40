//! End of a run: by time, at a chainage, stopped from outside, or at the end of the track.

use super::estimators::RunningEstimator;
use crate::error::Error;
use crate::interrupt;

/// Conditions for the end of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct EndCondition {
    /// After this time, s.
    pub after_s: f64,
    /// Chainage of the front at which the run ends, m; infinite without this condition.
    pub at_m: f64,
    /// Chainage of the front at the start, m.
    pub start_m: f64,
    /// Length of the train, m: with its front here, its rear is at the start of the track.
    pub train_length_m: f64,
    /// End of the track, m: a train that runs off it, or off its start, is an error.
    pub track_length_m: f64,
}

/// Reason for which a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// The scenario's end was reached: its chainage if it names one, else its time.
    Finished,
    /// The time ended before the train reached the chainage.
    TimeOver,
    /// The run was stopped from outside.
    Interrupted,
}

/// Result of a run.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Outcome {
    /// Simulated time, s.
    pub simulated_s: f64,
    /// Steps of the plant.
    pub steps: u64,
    /// True if the scenario's end was reached: its chainage if it names one, else its time.
    pub finished: bool,
    /// True if it was stopped from outside.
    pub interrupted: bool,
    /// Steps that each estimator refused, by name, with the first reason.
    pub refusals: Vec<(String, u64, String)>,
}

/// Number of steps between two calls of `go_on`; a wish to end is obeyed at once.
const STEPS_PER_QUESTION: u64 = 512;

/// Sag allowed for a train whose rear stands at the start of the track, m.
const OFF_START_M: f64 = 0.1;

impl EndCondition {
    /// Reason for the end of the run, with the front at `front_m` (m) at `t_s` (s), before step `step` of `dt_s` (s);
    /// none while it goes on. `go_on` gets the share done, 0…1, now and then, and returns false to stop the run.
    pub fn reached(
        &self,
        (t_s, dt_s): (f64, f64),
        front_m: f64,
        step: u64,
        go_on: &mut dyn FnMut(f64) -> bool,
    ) -> Result<Option<Ended>, Error> {
        let arrived = front_m >= self.at_m;
        if arrived || t_s >= self.after_s - 0.5 * dt_s {
            return Ok(Some(match arrived || self.at_m == f64::INFINITY {
                true => Ended::Finished,
                false => Ended::TimeOver,
            }));
        }
        if step.is_multiple_of(STEPS_PER_QUESTION) || interrupt::requested() {
            let by_time = t_s / self.after_s;
            let by_way = (front_m - self.start_m) / (self.at_m - self.start_m);
            if !go_on(by_time.max(by_way).clamp(0.0, 1.0)) {
                return Ok(Some(Ended::Interrupted));
            }
        }
        if front_m > self.track_length_m {
            let end_m = self.track_length_m;
            return Err(Error::Broken {
                t_s,
                what: format!("the train ran off the end of the track at {end_m:.1} m"),
            });
        }
        if front_m < self.train_length_m - OFF_START_M {
            return Err(Error::Broken {
                t_s,
                what: format!(
                    "the train ran off the start of the track: its front is at {front_m:.1} m, its rear at {:.1} m",
                    front_m - self.train_length_m
                ),
            });
        }
        Ok(None)
    }
}

impl Outcome {
    /// The outcome of a run that ended at `simulated_s` (s) after so many steps.
    pub(super) fn new(
        ended: Ended,
        simulated_s: f64,
        steps: u64,
        estimators: &[RunningEstimator],
    ) -> Self {
        Self {
            simulated_s,
            steps,
            finished: ended == Ended::Finished,
            interrupted: ended == Ended::Interrupted,
            refusals: estimators
                .iter()
                .filter_map(RunningEstimator::refusals)
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The front beyond the end, or the rear before the start: both end the run as broken.
    #[test]
    fn both_ends_of_the_track_end_the_run() {
        let end = EndCondition {
            after_s: 10.0,
            at_m: f64::INFINITY,
            start_m: 25.0,
            train_length_m: 20.0,
            track_length_m: 100.0,
        };
        let at = |front_m| end.reached((1.0, 0.002), front_m, 1, &mut |_| true);
        assert!(matches!(at(20.0), Ok(None)) && matches!(at(100.0), Ok(None)));
        for (front_m, word) in [(19.0, "start"), (-94.0, "start"), (100.1, "end")] {
            let told = at(front_m).unwrap_err().to_string();
            assert!(
                told.contains(&format!("off the {word} of the track")),
                "{told}"
            );
        }
    }
}
