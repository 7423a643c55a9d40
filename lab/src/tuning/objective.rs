//! The objective of a study as a plain function of its parameters, for your own search.

use crate::tuning::baseline::Baseline;
use crate::tuning::evaluate::{Evaluator, Means, Stage};
use crate::tuning::progress::Progress;
use crate::tuning::study::TuningStudy;
use crate::tuning::trial_store::Trial;
use monorig_sim::config::scenario::ParameterValue;
use monorig_sim::error::Error;
use std::collections::BTreeMap;

/// Scores parameters over the tuning runs, as the search of the study does.
pub struct StudyObjective<'a> {
    study: &'a TuningStudy,
    evaluator: Evaluator<'a>,
    baseline: Baseline,
}

impl<'a> StudyObjective<'a> {
    /// Prepares the tuning runs and measures the defaults, whose losses are the unit of all losses. None if `progress`
    /// stopped it.
    pub fn new(
        study: &'a TuningStudy,
        means: Means<'a>,
        progress: &dyn Progress,
    ) -> Result<Option<Self>, Error> {
        let Some(evaluator) = Evaluator::prepare(study, Stage::Tuning, means, progress)? else {
            return Ok(None);
        };
        Ok(Some(Self {
            study,
            baseline: Baseline::new(study, "tuning", &study.tuning, &evaluator)?,
            evaluator,
        }))
    }

    /// Score of these parameters; other parameters have their defaults.
    pub fn score(&self, parameters: BTreeMap<String, ParameterValue>) -> Result<Trial, Error> {
        for (key, value) in &parameters {
            let checked = self.study.of.check(key, value.setting());
            checked.map_err(|w| self.study.error("parameters", w))?;
        }
        let measured = self.evaluator.evaluate(&parameters);
        Ok(self.baseline.trial(0, "asked", parameters, &measured))
    }
}

impl TuningStudy {
    /// Ranges of the varied parameters, as in the file.
    pub fn ranges(&self) -> serde_json::Value {
        // Strings, flags and finite numbers: nothing in here can fail to serialise.
        serde_json::to_value(&self.file.parameters).unwrap_or_default()
    }
}
