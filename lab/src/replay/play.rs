//! Plays recorded columns to an estimator.

use crate::metrics::series::{ErrorSample, ErrorSampler};
use crate::replay::ReplayData;
use monorig_sim::closed_loop::estimators::RunningEstimator;
use monorig_sim::closed_loop::registry::BoxedEstimator;
use monorig_sim::error::Error;

/// Gives an estimator what it would have been given in the run, and returns its errors, one per step. They are bit for
/// bit those of the run, because the same code makes them. `name` is the estimator's in messages.
pub fn play(
    columns: &ReplayData,
    name: &str,
    estimator: BoxedEstimator,
) -> Result<Vec<ErrorSample>, Error> {
    let mut member = RunningEstimator::new(name, estimator);
    let mut comparison = ErrorSampler::of(&member);
    let mut samples = Vec::with_capacity(columns.len());
    let mut last_s = 0.0;
    let mut steps = columns.steps();
    while let Some((z, command, truth)) = steps.advance() {
        member.step(z, command, truth.t_s - last_s)?;
        last_s = truth.t_s;
        samples.push(comparison.sample(&member, truth));
    }
    Ok(samples)
}
