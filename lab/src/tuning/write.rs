//! The files of a tuning study: `winner.yaml`, `validation.json`, `sensitivity.json`. Each is written whole or not at
//! all.

use crate::tuning::search::SearchResult;
use crate::tuning::sensitivity::Sensitivity;
use crate::tuning::study::TuningStudy;
use crate::tuning::validate::Validation;
use monorig_sim::config::checked::Version1;
use monorig_sim::config::scenario::{ParameterFile, Provenance};
use monorig_sim::error::Error;
use monorig_sim::record::identity::Identity;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// The winner as a parameter file; `None` without a winner.
pub(crate) fn winner(
    study: &TuningStudy,
    search: &SearchResult,
    validation: &Validation,
    monorig: &Identity,
) -> Option<ParameterFile> {
    let trial = search.winner.and_then(|i| search.trials.get(i))?;
    let file = &study.file;
    Some(ParameterFile {
        version: Version1,
        why: format!("Winner of the study {}: {}", study.name, file.why.trim()),
        estimator: study.of.name().to_owned(),
        parameters: study.settings(&trial.parameters).values,
        provenance: Some(Provenance {
            study: study.name.clone(),
            study_hash: study.campaign(monorig).hash,
            monorig: monorig.to_string(),
            optimiser: serde_json::to_value(file.optimiser)
                .ok()
                .and_then(|v| v.as_str().map(str::to_owned))
                .unwrap_or_default(),
            seed: file.seed,
            trials: search.trials.len(),
            trial: trial.trial,
            tuning_loss: trial.loss(),
            validation_loss: validation.validation_loss,
            verdict: validation
                .comparisons
                .first()
                .map(|c| c.verdict.words().to_owned())
                .unwrap_or_default(),
        }),
    })
}

/// Write a value as JSON.
pub(crate) fn json(folder: &Path, name: &str, value: &impl Serialize) -> Result<PathBuf, Error> {
    // Strings and numbers: nothing in here can fail to serialise; what is not finite becomes null.
    let text = serde_json::to_string_pretty(value).unwrap_or_default() + "\n";
    whole(&folder.join(name), &text)
}

/// Write validation and sensitivity.
pub(crate) fn findings(
    folder: &Path,
    validation: &Validation,
    sensitivity: &Sensitivity,
) -> Result<(), Error> {
    json(folder, "validation.json", validation)?;
    json(folder, "sensitivity.json", sensitivity)?;
    Ok(())
}

/// Write a file under a temporary name, then move it into place.
pub(crate) fn whole(path: &Path, text: &str) -> Result<PathBuf, Error> {
    monorig_sim::record::whole::write(path, text.as_bytes())?;
    Ok(path.to_owned())
}
