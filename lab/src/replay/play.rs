//! Plays recorded columns to an estimator.

use crate::metrics::series::{ErrorSample, ErrorSampler};
use crate::replay::ReplayData;
use monorig_sim::closed_loop::estimators::RunningEstimator;
use monorig_sim::closed_loop::registry::BoxedEstimator;
use monorig_sim::error::Error;

/// Number of samples passed on at once: few enough to stay in the cache of the processor.
const BATCH: usize = 64;

/// Gives an estimator its inputs of the run, and passes on its errors, one per step, in batches. They are bit for bit
/// those of the run, because the same code makes them. `name` is the estimator's in messages.
pub fn play(
    columns: &ReplayData,
    name: &str,
    estimator: BoxedEstimator,
    mut take: impl FnMut(&[ErrorSample]),
) -> Result<(), Error> {
    let mut member = RunningEstimator::new(name, estimator);
    let mut comparison = ErrorSampler::of(&member);
    let mut batch = Vec::with_capacity(BATCH);
    let mut last_s = 0.0;
    let mut steps = columns.steps();
    while let Some((z, command, truth)) = steps.advance() {
        member.step(z, command, truth.t_s - last_s)?;
        last_s = truth.t_s;
        batch.push(comparison.sample(&member, truth));
        if batch.len() == BATCH {
            take(&batch);
            batch.clear();
        }
    }
    take(&batch);
    Ok(())
}
