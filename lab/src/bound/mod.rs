//! Posterior Cramér-Rao bound (Tichavský, Muravchik and Nehorai 1998) of slope, effective grade and mass for the
//! motion of a run and the noise of its sensor sheet: what no estimator can be better than, on average over runs.
//!
//! The recursion is linearised on the true motion, where all that is random is Gaussian: it is then the covariance of
//! the Kalman filter with the true model. In it are white noise, biases, scale errors and random walks of the sheet;
//! priors of mass, running resistance and the rail behind the train. Not in it are what makes a model wrong: rail
//! that was not read ahead of the middle of the unit, slip, sway of the load, vibration, hits, faults, misalignment,
//! delays. An estimator may be better than the bound in one run, whose biases happen to be small; the bound is for
//! the root mean square over runs.

mod attitude;
mod channels;
mod mass;
mod running;
mod sheet;

pub use channels::{BoundChannels, descriptions};
pub use running::BoundSample;
pub(crate) use running::RunningBound;
pub use sheet::SheetNoise;

use monorig_sim::closed_loop::Simulation;
use monorig_sim::closed_loop::run::{Observer, StepFrame};
use monorig_sim::error::Error;
use std::collections::VecDeque;

/// Errors count from here on, s: before, nothing has been measured.
pub const AFTER_S: f64 = 5.0;
/// Distance of two rows of the table of a bound, s.
const EVERY_S: f64 = 0.1;

/// Mean squares of an estimator's errors, over the same samples as those of the bound.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeanSquares {
    /// rad².
    pub slope: f64,
    /// rad².
    pub effective: f64,
    /// Square of the mean relative error of the mass in the last second of the run.
    pub mass_at_end: f64,
}

/// The bound of one run, and the errors of its estimators beside it.
#[derive(Clone, Debug, Default)]
pub struct RunBound {
    /// The bound over time.
    pub samples: Vec<BoundSample>,
    /// Its mean squares from [`AFTER_S`] on.
    pub bound: MeanSquares,
    /// Those of the estimators on all samples from [`AFTER_S`] on, marked valid or not.
    pub estimators: Vec<(String, MeanSquares)>,
}

/// Computes the bound while a run goes on, and the errors of the estimators beside it.
#[derive(Default)]
pub struct BoundObserver {
    bound: Option<RunningBound>,
    /// When the next row is due, s.
    next_row_s: f64,
    counted: f64,
    /// Relative errors of the mass in the last second.
    last_second: Vec<VecDeque<f64>>,
    run: RunBound,
}

impl BoundObserver {
    /// The bound of the run.
    pub fn into_run(self) -> RunBound {
        let mut run = self.run;
        let counted = self.counted.max(1.0);
        run.bound.slope /= counted;
        run.bound.effective /= counted;
        run.bound.mass_at_end = run
            .samples
            .last()
            .map_or(f64::NAN, |s| s.mass_rel * s.mass_rel);
        for ((_, sums), errors) in run.estimators.iter_mut().zip(self.last_second) {
            sums.slope /= counted;
            sums.effective /= counted;
            let mean = errors.iter().sum::<f64>() / errors.len() as f64;
            sums.mass_at_end = mean * mean;
        }
        run
    }
}

impl Observer for BoundObserver {
    fn begin(&mut self, simulation: &Simulation) -> Result<(), Error> {
        self.bound = RunningBound::of(simulation);
        let names = simulation.estimators.iter().map(|e| e.name.clone());
        self.run.estimators = names.map(|name| (name, MeanSquares::default())).collect();
        self.last_second = vec![VecDeque::new(); self.run.estimators.len()];
        Ok(())
    }

    fn on_step(&mut self, frame: &StepFrame<'_>) -> Result<(), Error> {
        let truth = frame.truth;
        let Some(bound) = &mut self.bound else {
            return Ok(());
        };
        if !bound.step(truth) {
            return Ok(());
        }
        let (Some(sample), Some(step_s)) = (bound.now(), bound.step_s()) else {
            return Ok(());
        };
        if truth.t_s + 1e-9 >= self.next_row_s {
            self.next_row_s += EVERY_S;
            self.run.samples.push(sample);
        }
        if truth.t_s < AFTER_S {
            return Ok(());
        }
        self.counted += 1.0;
        self.run.bound.slope += sample.slope_rad * sample.slope_rad;
        self.run.bound.effective += sample.effective_rad * sample.effective_rad;
        for (((_, sums), member), last) in self
            .run
            .estimators
            .iter_mut()
            .zip(frame.estimators)
            .zip(&mut self.last_second)
        {
            let e = &member.estimate;
            let slope = e.grade_rad.value - truth.grade_at_imu_rad;
            let effective = e.effective_grade_rad.value - truth.grade_effective_rad;
            sums.slope += slope * slope;
            sums.effective += effective * effective;
            last.push_back(e.total_mass_kg.value / truth.total_mass_kg - 1.0);
            if last.len() as f64 * step_s > 1.0 {
                last.pop_front();
            }
        }
        Ok(())
    }
}
