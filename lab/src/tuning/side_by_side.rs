//! Defaults, published constants and winner side by side in one run, to be looked at.

use crate::tuning::space::Values;
use crate::tuning::study::{Evaluation, TuningStudy};
use monorig_estimators::registry;
use monorig_sim::closed_loop::Simulation;
use monorig_sim::closed_loop::estimators::RunningEstimator;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::config::checked::Finite;
use monorig_sim::config::scenario::{ParameterValue, Settings};
use monorig_sim::error::Error;
use std::collections::BTreeMap;

/// The rig of the first validation run. Its bank is the study's estimator as `default`, as `published` if the study names such
/// constants, and as `winner`; before them the one in the loop, if there is one, because it decides the motion.
pub fn rig(study: &TuningStudy, winner: &Values) -> Result<Option<Simulation>, Error> {
    let Some(group) = study.validation.first() else {
        return Ok(None);
    };
    let (mut scenario, estimator) = (group.scenario.clone(), &study.file.estimator);
    if study.file.evaluation == Evaluation::ClosedLoop {
        let all = settings(study, winner);
        let bank = &mut scenario.file.estimators;
        bank.insert(estimator.clone(), Settings::new(all));
    }
    let mut rig = Simulation::build(
        scenario,
        &Registry::default(),
        group.seeds.first().copied().unwrap_or(1),
    )?;
    let in_loop = rig.in_loop.map(|i| rig.estimators.swap_remove(i));
    rig.in_loop = in_loop.is_some().then_some(0);
    rig.estimators = in_loop.into_iter().collect();
    let sets = [
        ("default", Some(study.defaults())),
        ("published", study.published()),
        ("winner", Some(winner.clone())),
    ];
    for (name, values) in sets {
        let Some(values) = values else { continue };
        let all = settings(study, &values);
        let named = all.iter().map(|(k, x)| (k.as_str(), x.setting()));
        let built = registry::build(estimator, &rig.vehicle, named).map_err(|e| {
            let help = "values that fit the vehicle of the validation runs".to_owned();
            study.error("parameters", (format!("{name}: {e}"), help))
        })?;
        rig.estimators
            .push(RunningEstimator::new(name, Box::new(built)));
    }
    rig.scenario.name = format!("{}-{}", study.name, rig.scenario.name);
    rig.scenario.file.why = study.file.why.clone();
    Ok(Some(rig))
}

/// What every trial has, and what this one has of its own.
fn settings(study: &TuningStudy, values: &Values) -> BTreeMap<String, ParameterValue> {
    let mut all = study.file.fixed.clone();
    for (key, x) in values {
        if let Ok(x) = Finite::try_from(*x) {
            all.insert(key.clone(), ParameterValue::Number(x));
        }
    }
    all
}
