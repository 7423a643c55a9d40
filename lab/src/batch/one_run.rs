//! One run of a study: headless, nothing written, whatever goes wrong is its result.

use crate::verdicts::expected;
use crate::verdicts::measure::SummaryObserver;
use crate::verdicts::run_result::RunResult;
use crate::verdicts::summary::Summary;
use monorig_sim::closed_loop::Simulation;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::run::{self, Observer, StepFrame};
use monorig_sim::config::file::Sets;
use monorig_sim::config::input_files::InputFiles;
use monorig_sim::config::scenario::Scenario;
use monorig_sim::error::Error;
use std::any::Any;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

/// One run to make: scenario, changes to it, seed.
#[derive(Clone, Debug, PartialEq)]
pub struct RunSpec {
    /// Place in the study, from 0.
    pub index: u64,
    /// Scenario file.
    pub scenario: PathBuf,
    /// Changes to it.
    pub changes: Sets,
    /// Files of the study with their content at its start.
    pub inputs: InputFiles,
    /// Seed.
    pub seed: u64,
    /// Values drawn for this run, by name.
    pub draws: BTreeMap<String, serde_json::Value>,
    /// Reference estimator of a comparison: errors are also taken over the samples that it and another estimator both
    /// mark valid.
    pub reference: Option<String>,
}

impl RunSpec {
    /// Makes a run without draws and without a reference.
    pub fn new(index: u64, scenario: &Path, seed: u64, changes: Sets, inputs: &InputFiles) -> Self {
        Self {
            index,
            scenario: scenario.into(),
            changes,
            inputs: inputs.clone(),
            seed,
            draws: BTreeMap::new(),
            reference: None,
        }
    }
}

/// The run was stopped from outside: it has no result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interrupted;

/// Run it. A scenario that cannot be used, a simulation that breaks down and a panic are results too: they belong to
/// this run, and the study goes on. `go_on` is asked now and then whether to go on.
pub fn run_one(
    spec: &RunSpec,
    registry: &Registry,
    go_on: &dyn Fn() -> bool,
) -> Result<RunResult, Interrupted> {
    run_observed(spec, registry, go_on, &mut |_: &StepFrame<'_>| {})
}

/// Makes the run with one more observer.
pub(crate) fn run_observed(
    spec: &RunSpec,
    registry: &Registry,
    go_on: &dyn Fn() -> bool,
    more: &mut dyn Observer,
) -> Result<RunResult, Interrupted> {
    let simulated = || simulate(spec, registry, go_on, more);
    let outcome = match catch_unwind(AssertUnwindSafe(simulated)) {
        Ok(Ok(None)) => return Err(Interrupted),
        Ok(Ok(Some(summary))) => Ok(summary),
        Ok(Err(e)) => Err(e.to_string()),
        Err(panic) => Err(format!("the run panicked: {}", panic_message(&*panic))),
    };
    let stem = spec.scenario.file_stem().unwrap_or_default();
    Ok(RunResult {
        index: spec.index,
        draws: spec.draws.clone(),
        ..RunResult::new(&stem.to_string_lossy(), spec.seed, outcome)
    })
}

/// `None` if the run was stopped.
fn simulate(
    spec: &RunSpec,
    registry: &Registry,
    go_on: &dyn Fn() -> bool,
    more: &mut dyn Observer,
) -> Result<Option<Summary>, Error> {
    let load = || Scenario::load_with(&spec.scenario, &spec.changes);
    let scenario = spec.inputs.during(load)?;
    expected::check(&scenario)?;
    let mut simulation = Simulation::build(scenario, registry, spec.seed)?;
    let mut observer = match &spec.reference {
        Some(reference) => SummaryObserver::against(reference),
        None => SummaryObserver::default(),
    };
    let outcome = run::run(&mut simulation, &mut [&mut observer, more], &mut |_| {
        go_on()
    })?;
    let summary = || observer.summary(&simulation.scenario, spec.seed, &outcome);
    Ok((!outcome.interrupted).then(summary))
}

fn panic_message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|s| (*s).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no message".to_owned())
}
