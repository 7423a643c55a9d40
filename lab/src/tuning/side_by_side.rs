//! Defaults, published constants and winner side by side in one run, to be looked at.

use crate::tuning::study::Values;
use crate::tuning::study::{Evaluation, TuningStudy};
use monorig_sim::closed_loop::Simulation;
use monorig_sim::closed_loop::estimators::RunningEstimator;
use monorig_sim::closed_loop::registry::Refusal;
use monorig_sim::error::Error;

/// The simulation of the first validation run. Its estimators are the study's as `default`, as `published` if the
/// study names such constants, and as `winner`; before them the one in the loop, if there is one, because it decides
/// the motion.
pub fn simulation(study: &TuningStudy, winner: &Values) -> Result<Option<Simulation>, Error> {
    let Some(group) = study.validation.first() else {
        return Ok(None);
    };
    let mut scenario = group.scenario.clone();
    if study.file.evaluation == Evaluation::ClosedLoop {
        let name = study.file.estimator.clone();
        scenario
            .file
            .estimators
            .insert(name, study.settings(winner));
    }
    let seed = group.seeds.first().copied().unwrap_or(1);
    let mut simulation = Simulation::build(scenario, &study.registry, seed)?;
    let in_loop = simulation
        .in_loop
        .map(|i| simulation.estimators.swap_remove(i));
    simulation.in_loop = in_loop.is_some().then_some(0);
    simulation.estimators = in_loop.into_iter().collect();
    let sets = [
        ("default", Some(study.defaults())),
        ("published", study.published()),
        ("winner", Some(winner.clone())),
    ];
    for (name, values) in sets {
        let Some(values) = values else { continue };
        let settings = study.settings(&values);
        let built = study
            .of
            .build(&simulation.vehicle, &settings.named())
            .map_err(|e| {
                let message = format!("{name}: {}", e.message);
                study.error("parameters", Refusal::new(message, e.help))
            })?;
        simulation
            .estimators
            .push(RunningEstimator::new(name, built));
    }
    simulation.scenario.name = format!("{}-{}", study.name, simulation.scenario.name);
    simulation.scenario.file.why = study.file.why.clone();
    Ok(Some(simulation))
}
