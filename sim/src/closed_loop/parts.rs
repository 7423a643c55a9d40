//! Builds the estimators, the controller, the instruments and the plant that a scenario names, from the registry.

use super::builder::MakeEstimator;
use super::estimators::RunningEstimator;
use super::registry::{BoxedController, BoxedEstimator, Refusal, Registry};
use crate::config::scenario::{InstrumentSettings, PlantKind, Scenario};
use crate::control::ControllerSetup;
use crate::error::Error;
use crate::guarded::guarded;
use crate::plant::{Plant, PlantSetup};
use crate::sensors::{Fitting, Instrument};
use monorig_estimators::api::signals::Vehicle;
use std::collections::{BTreeMap, BTreeSet};

/// The estimators of a scenario in the order of their names: those given, the others checked and built.
pub fn estimators(
    scenario: &Scenario,
    registry: &Registry,
    vehicle: &Vehicle,
    given: &mut BTreeMap<String, MakeEstimator>,
) -> Result<Vec<RunningEstimator>, Error> {
    let mut built = Vec::new();
    for (name, settings) in &scenario.file.estimators {
        let at = format!("estimators.{name}");
        if let Some(make) = given.remove(name) {
            let made = made(|| make(vehicle));
            let estimator = made.map_err(|w| scenario.error(at, w.message, w.help))?;
            built.push(RunningEstimator::new(name, estimator));
            continue;
        }
        let of_type = registry.estimator_of(name, settings).map_err(|w| {
            match (&settings.is, settings.is_foreign()) {
                (_, true) => {
                    let at = format!("{at}.{}", settings.foreign_key());
                    scenario.error(at, w.message, w.help)
                }
                (Some(_), false) => scenario.error(format!("{at}.is"), w.message, w.help),
                (None, false) => {
                    let help = format!(
                        "{}; `is` names the type of an estimator with another name",
                        w.help
                    );
                    scenario.error(at.clone(), w.message, help)
                }
            }
        })?;
        for (key, value) in settings.named() {
            of_type
                .check(key, value)
                .map_err(|w| scenario.parameter_error(name, key, w.message, w.help))?;
        }
        let estimator = made(|| of_type.build(vehicle, &settings.named()))
            .map_err(|w| scenario.error(at, w.message, w.help))?;
        if let Some(bad) = bad_internal(&estimator) {
            let message = format!("one of its internal quantities is called {bad:?}");
            let help = "give each result its own name, without slashes and control characters";
            return Err(scenario.error(format!("estimators.{name}"), message, help));
        }
        let mut running = RunningEstimator::new(name, estimator);
        running.reference = of_type.reference;
        running.answers = of_type.answers.clone();
        built.push(running);
    }
    Ok(built)
}

/// Returns the first internal quantity of an estimator whose name cannot be the name of a column.
fn bad_internal(estimator: &BoxedEstimator) -> Option<&'static str> {
    let mut names = BTreeSet::new();
    let odd = |c: char| c.is_control() || "/\\".contains(c);
    let mut all = estimator.internals().iter().map(|i| i.name);
    all.find(|name| name.is_empty() || name.contains(odd) || !names.insert(*name))
}

/// The controller of a scenario, checked and built.
pub fn controller(
    scenario: &Scenario,
    registry: &Registry,
    vehicle: &Vehicle,
    setup: &ControllerSetup,
) -> Result<BoxedController, Error> {
    let settings = &scenario.file.drive.controller;
    let at = |key: &str, w: Refusal| {
        scenario.error(format!("drive.controller.{key}"), w.message, w.help)
    };
    let key = settings.fmu.as_ref().map_or("kind", |_| "fmu");
    let of_kind = registry.controller_of(settings).map_err(|w| at(key, w))?;
    for (key, value) in settings.named() {
        of_kind.check(key, value).map_err(|w| at(key, w))?;
    }
    made(|| of_kind.build(vehicle, setup, &settings.named()))
        .map_err(|w| scenario.error("drive.controller", w.message, w.help))
}

/// Builds the instruments that a scenario names beside the instruments of its sheet, in the order of their names.
pub fn instruments(
    scenario: &Scenario,
    registry: &Registry,
    on: &Fitting<'_>,
) -> Result<Vec<Box<dyn Instrument>>, Error> {
    let build = |(name, settings): (&String, &InstrumentSettings)| {
        let at = format!("instruments.{name}");
        let refused = |at: &str, w: Refusal| scenario.error(at, w.message, w.help);
        let of_type = registry
            .find_instrument(name)
            .map_err(|w| refused(&at, w))?;
        let values = settings.named();
        for (key, value) in &values {
            of_type
                .check(key, *value)
                .map_err(|w| refused(&format!("{at}.{key}"), w))?;
        }
        let built = made(|| of_type.build(on, &values)).map_err(|w| refused(&at, w))?;
        match built.name() == name {
            true => Ok(built),
            false => {
                let message = format!("the name of this instrument is `{}`", built.name());
                let help = format!(
                    "let `Instrument::name` return `{name}`, the name under which the instrument was added"
                );
                Err(scenario.error(at, message, help))
            }
        }
    };
    scenario.file.instruments.iter().map(build).collect()
}

/// The plant that a scenario names, checked and built, if it is one of the registry.
pub fn plant(
    scenario: &Scenario,
    registry: &Registry,
    setup: &PlantSetup<'_>,
) -> Result<Option<Box<dyn Plant>>, Error> {
    let Some(PlantKind::Own(settings)) = &scenario.file.physics.plant else {
        return Ok(None);
    };
    let refused = |at: &str, w: Refusal| scenario.error(at, w.message, w.help);
    let of_kind = registry
        .find_plant(&settings.kind)
        .map_err(|w| refused("physics.plant", w))?;
    let values = settings.named();
    for (key, value) in &values {
        of_kind
            .check(key, *value)
            .map_err(|w| refused(&format!("physics.plant.{key}"), w))?;
    }
    let built = made(|| of_kind.build(setup, &values));
    built.map(Some).map_err(|w| refused("physics.plant", w))
}

/// Builds a part. A panic is a refusal.
fn made<T>(build: impl FnOnce() -> Result<T, Refusal>) -> Result<T, Refusal> {
    guarded(build).unwrap_or_else(|told| {
        let help = "use values with which it can be built";
        Err(Refusal::new(format!("it panicked: {told}"), help))
    })
}
