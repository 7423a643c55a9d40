//! Plays recorded columns to an estimator.

use crate::metrics::series::ErrorSample;
use crate::replay::ReplayData;
use monorig_sim::closed_loop::estimators::RunningEstimator;
use monorig_sim::closed_loop::registry::BoxedEstimator;

/// Gives an estimator what it would have been given in the run, and puts its errors into `samples`, one per step. They are
/// bit for bit those of the run, because the same code makes them.
pub fn play(columns: &ReplayData, estimator: BoxedEstimator, samples: &mut Vec<ErrorSample>) {
    samples.clear();
    samples.reserve(columns.len());
    let mut member = RunningEstimator::new("", estimator);
    let mut last_s = 0.0;
    let mut steps = columns.steps();
    while let Some((z, command, truth)) = steps.advance() {
        member.step(z, command, truth.t_s - last_s);
        last_s = truth.t_s;
        samples.push(ErrorSample::new(&member, truth));
    }
}
