//! A scenario, read and checked by building the simulation of the first of its seeds.

use monorig_lab::verdicts::expected;
use monorig_sim::closed_loop::Simulation;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::config::file::Sets;
use monorig_sim::config::scenario::Scenario;
use monorig_sim::error::Error;
use std::path::Path;

/// Reads a scenario with changes, and every file it names; checks them against each other.
pub fn simulation(path: &Path, changes: &Sets, registry: &Registry) -> Result<Simulation, Error> {
    built(Scenario::load_with(path, changes)?, registry)
}

/// Builds the simulation of the first seed of a scenario.
pub fn built(scenario: Scenario, registry: &Registry) -> Result<Simulation, Error> {
    expected::check(&scenario)?;
    let seed = scenario.seeds().first().copied().unwrap_or(1);
    Simulation::build(scenario, registry, seed)
}
