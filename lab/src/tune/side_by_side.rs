//! Defaults, published constants and winner side by side in one run, to be looked at.

use super::space::Values;
use super::study::{Evaluation, Study};
use monorig_estimators::registry;
use monorig_sim::bank::Member;
use monorig_sim::checked::Finite;
use monorig_sim::error::Error;
use monorig_sim::rig::Rig;
use monorig_sim::scenario::{ParameterValue, Settings};
use std::collections::BTreeMap;

/// The rig of the first validation run. Its bank is the study's estimator as `default`, as `published` if the study names such
/// constants, and as `winner`; before them the one that the controller hears, if it hears one, because it decides the motion.
pub fn rig(study: &Study, winner: &Values) -> Result<Option<Rig>, Error> {
    let Some(group) = study.validation.first() else {
        return Ok(None);
    };
    let (mut scenario, estimator) = (group.scenario.clone(), &study.file.estimator);
    if study.file.evaluation == Evaluation::ClosedLoop {
        let all = settings(study, winner);
        let bank = &mut scenario.file.estimators;
        bank.insert(estimator.clone(), Settings::new(all));
    }
    let mut rig = Rig::build(scenario, group.seeds.first().copied().unwrap_or(1))?;
    let in_loop = rig.in_loop.map(|i| rig.bank.swap_remove(i));
    rig.in_loop = in_loop.is_some().then_some(0);
    rig.bank = in_loop.into_iter().collect();
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
        rig.bank.push(Member::new(name.into(), built));
    }
    rig.scenario.name = format!("{}-{}", study.name, rig.scenario.name);
    rig.scenario.file.why = study.file.why.clone();
    Ok(Some(rig))
}

/// What every trial has, and what this one has of its own.
fn settings(study: &Study, values: &Values) -> BTreeMap<String, ParameterValue> {
    let mut all = study.file.fixed.clone();
    for (key, x) in values {
        if let Ok(x) = Finite::try_from(*x) {
            all.insert(key.clone(), ParameterValue::Number(x));
        }
    }
    all
}
