//! The objective of a study as a plain function of its parameters, for a search of one's own.

use crate::tuning::baseline::Baseline;
use crate::tuning::evaluate::{Evaluator, Means, Stage};
use crate::tuning::progress::Progress;
use crate::tuning::study::TuningStudy;
use crate::tuning::trial_store::Trial;
use monorig_sim::config::scenario::ParameterValue;
use monorig_sim::error::Error;
use std::collections::BTreeMap;

/// Scores parameters as the search of the study does, over its tuning runs.
pub struct StudyObjective<'a> {
    study: &'a TuningStudy,
    evaluator: Evaluator<'a>,
    baseline: Baseline,
}

impl<'a> StudyObjective<'a> {
    /// Makes the tuning runs ready and measures the defaults, which losses are shares of. None if `progress` stopped
    /// it.
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

    /// The score of these parameters; those that are not named have their defaults.
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
    /// The ranges of the parameters that vary, as they stand in the file.
    pub fn ranges(&self) -> serde_json::Value {
        // Strings, flags and finite numbers: nothing in here can fail to serialise.
        serde_json::to_value(&self.file.parameters).unwrap_or_default()
    }
}
