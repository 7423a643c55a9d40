//! Everything about a scenario or a tuning study that can be found wrong without running it.

use monorig_lab::tuning::TuningStudy;
use monorig_lab::verdicts::expected;
use monorig_sim::closed_loop::Simulation;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::config::file::Sets;
use monorig_sim::config::scenario::Scenario;
use monorig_sim::error::Error;
use std::path::Path;

/// Read a scenario with `--set` applied, and every file it names; check them against each other by building the
/// simulation of the first of its seeds.
pub fn simulation(
    path: &Path,
    overrides: &[(String, String)],
    registry: &Registry,
) -> Result<Simulation, Error> {
    changed(path, &Sets::new(overrides), registry)
}

/// Reads and checks a scenario with changes that may come from another file.
pub fn changed(path: &Path, changes: &Sets, registry: &Registry) -> Result<Simulation, Error> {
    let scenario = Scenario::load_with(path, changes)?;
    expected::check(&scenario)?;
    let seed = scenario.seeds().first().copied().unwrap_or(1);
    Simulation::build(scenario, registry, seed)
}

/// Read a tuning study and every file it names, and check them.
pub fn tuning(path: &Path, registry: &Registry) -> Result<TuningStudy, Error> {
    TuningStudy::load(path, registry)
}
