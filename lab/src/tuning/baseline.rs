//! What the defaults show in the runs of a study: every trial is measured by them.

use crate::tuning::evaluate::{Bench, Shown};
use crate::tuning::loss::{Judge, wanted};
use crate::tuning::study::{Group, Study};
use monorig_sim::error::Error;

/// The defaults over some runs.
#[derive(Clone, Debug)]
pub struct Yardstick {
    /// Judges trials by them.
    pub judge: Judge,
    /// What they have shown, run by run.
    pub defaults: Vec<Shown>,
}

impl Yardstick {
    /// The defaults over the runs of `bench`, the groups of the study under `key`. An error where a metric of theirs is not a
    /// number (say, as nothing is vouched for): there is nothing to measure trials by.
    pub fn new(study: &Study, key: &str, groups: &[Group], bench: &Bench) -> Result<Self, Error> {
        let defaults = bench.evaluate(&study.defaults(), &wanted(&study.file));
        for shown in &defaults {
            let wrong = |what: String| {
                let message = format!(
                    "the defaults give nothing to measure trials by: seed {}: {what}",
                    shown.seed
                );
                let help =
                    "another window of time for the metric, another metric, or another scenario";
                study.error(
                    format!("{key}[{}].scenario", shown.group),
                    (message, help.into()),
                )
            };
            let values = shown.values.as_ref().map_err(|why| wrong(why.clone()))?;
            for (term, value) in study.file.objective.metrics.iter().zip(values) {
                if !value.is_finite() {
                    let what = format!(
                        "{} is not a number (nothing is vouched for then)",
                        term.metric
                    );
                    return Err(wrong(what));
                }
            }
        }
        let judge = Judge::new(&study.file, groups, &defaults);
        Ok(Self { judge, defaults })
    }
}
