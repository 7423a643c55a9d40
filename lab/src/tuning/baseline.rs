//! Results of the defaults in the runs of a study: every trial is measured by them.

use crate::tuning::evaluate::{Evaluator, RunMetrics};
use crate::tuning::loss::Judge;
use crate::tuning::study::{RunGroup, TuningStudy, Values};
use crate::tuning::trial_store::Trial;
use monorig_sim::closed_loop::registry::Refusal;
use monorig_sim::error::Error;

/// The defaults over some runs.
#[derive(Clone, Debug)]
pub(crate) struct Baseline {
    /// Judges trials by the results of the defaults.
    pub(crate) judge: Judge,
    /// Metrics of the defaults, run by run.
    pub(crate) defaults: Vec<RunMetrics>,
}

impl Baseline {
    /// The defaults over the runs of `evaluator`, the groups of the study under `key`. An error where a metric of
    /// theirs is not a number (such as without a valid sample): there is nothing to measure trials by.
    pub(crate) fn new(
        study: &TuningStudy,
        key: &str,
        groups: &[RunGroup],
        evaluator: &Evaluator<'_>,
    ) -> Result<Self, Error> {
        let defaults = evaluator.evaluate(&study.defaults());
        for measured in &defaults {
            let wrong = |what: String| {
                let refusal = Refusal {
                    message: format!(
                        "the results of the defaults cannot scale the loss of trials: seed {}: {what}",
                        measured.seed
                    ),
                    help:
                        "use another window of time for the metric, another metric, or another scenario"
                            .into(),
                };
                study.error(format!("{key}[{}].scenario", measured.group), refusal)
            };
            let values = measured.values.as_ref().map_err(|why| wrong(why.clone()))?;
            for (term, value) in study.file.objective.metrics.iter().zip(values) {
                if !value.is_finite() {
                    let what = format!("{} is not a number (no sample is valid then)", term.metric);
                    return Err(wrong(what));
                }
            }
        }
        let judge = Judge::new(&study.file, groups, &defaults);
        Ok(Self { judge, defaults })
    }

    /// Trial of these parameters, with its measured values.
    pub(crate) fn trial(
        &self,
        index: usize,
        origin: &str,
        parameters: Values,
        measured: &[RunMetrics],
    ) -> Trial {
        let verdict = self.judge.judge(measured);
        Trial {
            trial: index,
            origin: origin.to_owned(),
            parameters,
            losses: verdict.losses,
            violation: verdict.violation,
            failed: verdict.failed,
        }
    }
}
