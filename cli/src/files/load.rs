//! Reads a scenario and checks it by building the simulation of its first seed.

use crate::ui::note::note;
use monorig_lab::verdicts::expected;
use monorig_sim::closed_loop::Simulation;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::config::file::Sets;
use monorig_sim::config::scenario::Scenario;
use monorig_sim::control::FeedForward;
use monorig_sim::error::Error;
use std::path::Path;

/// Reads a scenario and every file it names, and checks them against each other. Foreign parts that the registry does
/// not run are left out.
pub fn check(path: &Path, registry: &Registry) -> Result<(), Error> {
    let mut scenario = Scenario::load_with(path, &Sets::default())?;
    expected::check(&scenario)?;
    let file = &mut scenario.file;
    let mut left_out = registry.leave_out_foreign(&mut file.estimators);
    file.in_loop
        .take_if(|name| !file.estimators.contains_key(name));
    if !left_out.is_empty() {
        // checked above; they may be about what is left out
        (file.expect, file.known_failures, file.published) = Default::default();
        file.integrity.reference_only.clear();
    }
    if file.in_loop.is_none() && !left_out.is_empty() {
        file.drive.controller.feedforward = FeedForward::None;
    }
    let fmu = file.drive.controller.fmu.clone();
    if let Some(fmu) = fmu.filter(|_| registry.allows_foreign("").is_err()) {
        file.drive.controller = Default::default();
        left_out.push(format!("the controller ({fmu})"));
    }
    say_left_out(&left_out);
    built(scenario, registry).map(drop)
}

/// Shows a note with the foreign parts that are not run.
pub fn say_left_out(parts: &[String]) {
    if !parts.is_empty() {
        let parts = parts.join(", ");
        note(&format!(
            "foreign code, not run without --allow-foreign: {parts}"
        ));
    }
}

/// Builds the simulation of the first seed of a scenario.
pub fn built(scenario: Scenario, registry: &Registry) -> Result<Simulation, Error> {
    expected::check(&scenario)?;
    let seed = scenario.seeds().first().copied().unwrap_or(1);
    Simulation::build(scenario, registry, seed)
}
