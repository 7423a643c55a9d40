//! Steps of a run at which errors are computed.

use monorig_sim::closed_loop::run::StepFrame;

/// Time without a sample after which errors are computed without new samples, s.
const SILENT_S: f64 = 0.5;

/// Time with samples after which the pace is known, s.
const KNOWN_S: f64 = 1.0;

/// Decides at which steps errors are computed: wherever a sample arrived, so that the estimators made a step. While
/// none arrives the last estimates stand, marked as they were, and errors are taken at the mean pace of the steps
/// before: who uses an estimate then is misled by it as at any other time.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pace {
    /// Number of steps with a sample, first and last instant of these, and the last instant used, s.
    steps: f64,
    first_s: f64,
    last_s: f64,
    taken_s: f64,
}

impl Pace {
    /// True if errors are computed at this step.
    pub(crate) fn takes(&mut self, f: &StepFrame<'_>) -> bool {
        self.takes_at(f.truth.t_s, f.sampled)
    }

    fn takes_at(&mut self, t_s: f64, sampled: bool) -> bool {
        if sampled {
            if self.steps == 0.0 {
                self.first_s = t_s;
            }
            self.steps += 1.0;
            (self.last_s, self.taken_s) = (t_s, t_s);
            return true;
        }
        let known_s = self.last_s - self.first_s;
        let interval_s = known_s / (self.steps - 1.0);
        let silent = known_s >= KNOWN_S && t_s - self.last_s >= SILENT_S;
        let due = silent && t_s - self.taken_s >= interval_s - 1e-9;
        if due {
            self.taken_s = t_s;
        }
        due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples every 20 ms, silence from 2 s to 5 s, steps of 2 ms: nothing before the first sample, every sample, and
    /// in silence the same pace from half a second on.
    #[test]
    fn silence_counts_at_the_pace_of_the_samples() {
        let mut pace = Pace::default();
        let steps = (1..=3000).map(|i| (0.002 * f64::from(i), i));
        let taken: Vec<f64> = steps
            .filter(|(t, i)| {
                let on = *t > 0.99 && !(*t > 2.001 && *t < 4.999);
                pace.takes_at(*t, on && i % 10 == 0)
            })
            .map(|(t, _)| t)
            .collect();
        let within = |a: f64, b: f64| taken.iter().filter(|t| **t > a && **t < b).count();
        assert_eq!(within(0.0, 0.99), 0);
        assert_eq!(within(0.99, 2.001), 51);
        assert_eq!(within(2.001, 2.495), 0);
        assert!((within(2.495, 4.999) as f64 - 125.0).abs() <= 1.0);
        assert_eq!(within(5.0, 6.0001), 50);
    }
}
