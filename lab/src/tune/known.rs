//! Which estimators, parameters and metrics there are, and what to say to one that is not.

use crate::metrics::{METRICS, RUN_METRICS};
use monorig_estimators::api::params::{Key, Kind, Setting};
use monorig_estimators::registry;
use monorig_sim::error::Error;
use monorig_sim::file::{input_error, nearest};
use monorig_sim::scenario::ParameterFile;
use std::path::Path;

/// What is wrong, and what would be right.
pub type Wrong = (String, String);

/// The estimator's name must be one there is.
pub fn estimator(name: &str) -> Result<(), Wrong> {
    if registry::NAMES.contains(&name) {
        return Ok(());
    }
    Err((
        format!("there is no estimator `{name}`"),
        choice(name, registry::NAMES, "known estimators"),
    ))
}

/// A parameter of an estimator.
pub fn parameter(estimator: &str, key: &str) -> Result<&'static Key, Wrong> {
    let keys = || registry::keys(estimator).into_iter().flatten();
    keys().find(|k| k.name == key).ok_or_else(|| {
        let names: Vec<&str> = keys().map(|k| k.name).collect();
        (
            format!("{estimator} has no parameter `{key}`"),
            choice(key, &names, "its parameters"),
        )
    })
}

/// A value that the parameter may have.
pub fn value(estimator: &str, key: &str, value: Setting) -> Result<(), Wrong> {
    let key = parameter(estimator, key)?;
    key.check(value).map_err(|_| {
        (
            format!("{value} is not {} ({})", key.kind, key.doc),
            format!("{}", key.kind),
        )
    })
}

/// A parameter that is a number: the only kind that can be searched.
pub fn number(estimator: &str, key: &str) -> Result<(), Wrong> {
    let found = parameter(estimator, key)?;
    match found.kind {
        Kind::Number { .. } => Ok(()),
        kind => Err((
            format!("`{key}` is {kind}, not a number: there is nothing to search"),
            format!("a number; or give it under `fixed`: `fixed: {{{key}: …}}`"),
        )),
    }
}

/// The metric's name must be one of an estimator or, where trials move the train, one of the run.
pub fn metric(name: &str, trials_move_the_train: bool) -> Result<(), Wrong> {
    let mut names: Vec<&str> = METRICS.iter().map(|m| m.name).collect();
    let of_run = || RUN_METRICS.iter().map(|m| m.name);
    if trials_move_the_train {
        names.extend(of_run());
    } else if of_run().any(|n| n == name) {
        return Err((
            format!(
                "`{name}` is a metric of the train and the controller, which a replay does not move"
            ),
            "`evaluation: closed_loop`, or a metric of the estimator".to_owned(),
        ));
    }
    if names.contains(&name) {
        return Ok(());
    }
    Err((
        format!("there is no metric `{name}`"),
        choice(name, &names, "known metrics"),
    ))
}

/// A parameter file whose estimator and parameters are there.
pub fn parameter_file(path: &Path) -> Result<ParameterFile, Error> {
    let file = ParameterFile::read(path)?;
    let at = |key: &str, (message, help): Wrong| input_error(path, key, message, help);
    estimator(&file.estimator).map_err(|w| at("estimator", w))?;
    for (key, x) in &file.parameters {
        value(&file.estimator, key, x.setting())
            .map_err(|w| at(&format!("parameters.{key}"), w))?;
    }
    Ok(file)
}

fn choice(word: &str, known: &[&str], title: &str) -> String {
    let list = format!("{title}: {}", known.join(", "));
    match nearest(word, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`? {list}"),
        None => list,
    }
}
