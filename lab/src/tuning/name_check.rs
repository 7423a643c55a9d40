//! Checks of the estimators, parameters and metrics that a study or a parameter file names.

use crate::metrics;
use crate::tuning::study::Range;
use monorig_estimators::api::params::KeyKind;
use monorig_sim::closed_loop::registry::{EstimatorType, Refusal, Registry};
use monorig_sim::config::file::input_error;
use monorig_sim::config::scenario::ParameterFile;
use monorig_sim::error::Error;
use std::path::Path;

/// Checks that a varied parameter exists, that its values are allowed, and that only a number has a range with two
/// ends; the error names the key below the parameter's key.
pub(crate) fn range(
    of: &EstimatorType,
    key: &str,
    range: &Range,
) -> Result<(), (&'static str, Refusal)> {
    let found = of.key(key).map_err(|w| ("", w))?;
    if range.choices.is_none() && !matches!(found.kind, KeyKind::Number { .. }) {
        let message = format!("`{key}` is {}, not a number with a range", found.kind);
        let help = format!(
            "give the values to try: `{key}: {{choices: [{}]}}`",
            words(found.kind)
        );
        return Err(("", Refusal { message, help }));
    }
    for (part, end) in [(".from", range.from), (".to", range.to)] {
        if let Some(x) = end {
            of.check(key, x.get().into()).map_err(|w| (part, w))?;
        }
    }
    for value in range.choices.iter().flatten() {
        of.check(key, value.setting())
            .map_err(|w| (".choices", w))?;
    }
    Ok(())
}

/// The values of a flag or a choice, as in a list.
fn words(kind: KeyKind) -> String {
    match kind {
        KeyKind::Choice { choices, .. } => choices.join(", "),
        _ => "true, false".into(),
    }
}

/// Checks that the name is a metric of an estimator or, if trials move the train, a metric of the run.
pub(crate) fn metric(name: &str, trials_move_the_train: bool) -> Result<(), Refusal> {
    let mut names: Vec<&str> = metrics::estimator_metrics().map(|m| m.name).collect();
    if trials_move_the_train {
        names.extend(metrics::run_metrics().map(|m| m.name));
    } else if metrics::run_metrics().any(|m| m.name == name) {
        return Err(Refusal {
            message: format!(
                "`{name}` is a metric of train and controller, which do not move in a replay"
            ),
            help: "use `evaluation: closed_loop`, or a metric of the estimator".to_owned(),
        });
    }
    if names.contains(&name) {
        return Ok(());
    }
    let message = format!("no metric is called `{name}`");
    Err(Refusal::new(message, metrics::advice(name, &names)))
}

/// Reads a parameter file whose estimator and parameters are in the registry.
pub fn parameter_file(path: &Path, registry: &Registry) -> Result<ParameterFile, Error> {
    let file = ParameterFile::read(path)?;
    let at = |key: &str, w: Refusal| input_error(path, key, w.message, w.help);
    let of = registry
        .find_estimator(&file.estimator)
        .map_err(|w| at("estimator", w))?;
    for (key, x) in &file.parameters {
        of.check(key, x.setting())
            .map_err(|w| at(&format!("parameters.{key}"), w))?;
    }
    Ok(file)
}
