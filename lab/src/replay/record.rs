//! Records a run's measurements: an observer, and the run that it observes.

use crate::bound::RunningBound;
use crate::metrics::lagged::GradeAtMiddle;
use crate::metrics::series::Target;
use crate::replay::ReplayData;
use monorig_estimators::api::signals::Command;
use monorig_sim::closed_loop::Simulation;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::run;
use monorig_sim::closed_loop::run::{Observer, StepFrame};
use monorig_sim::config::scenario::Scenario;
use monorig_sim::error::Error;

/// Keeps the inputs of the estimators.
pub struct ReplayRecorder {
    /// The recording so far.
    pub columns: ReplayData,
    last: Command,
    bound: Option<RunningBound>,
    middle: GradeAtMiddle,
}

impl ReplayRecorder {
    /// Makes the recorder for a run of this simulation.
    pub fn new(simulation: &Simulation) -> Self {
        Self {
            columns: ReplayData::new(simulation.vehicle),
            last: Command::default(),
            bound: RunningBound::of(simulation),
            middle: GradeAtMiddle::of(simulation),
        }
    }
}

impl Observer for ReplayRecorder {
    fn on_step(&mut self, f: &StepFrame<'_>) -> Result<(), Error> {
        let bound = self.bound.as_mut().and_then(|bound| {
            bound.step(f.truth);
            bound.now()
        });
        if f.sampled {
            let change = (*f.command != self.last).then_some(f.command);
            let middle = self.middle.at(f.truth.chainage_m);
            let truth = Target::of(f.truth, bound, middle);
            self.columns.push(f.measurements, change, truth);
            self.last = *f.command;
        }
        Ok(())
    }
}

/// The scenario without the estimators that do not influence the run: only that in the loop stays.
pub(crate) fn bare(scenario: &Scenario) -> Scenario {
    let mut bare = scenario.clone();
    let in_loop = bare.file.in_loop.clone();
    bare.file
        .estimators
        .retain(|name, _| in_loop.as_ref() == Some(name));
    // nothing is judged here, and what is judged must be among the estimators
    bare.file.expect.clear();
    bare.file.known_failures.clear();
    bare.file.integrity.reference_only.clear();
    bare
}

/// Runs a scenario with a seed to its end and records it. `go_on` as in [`run::run`]; a run that was stopped gives
/// none.
pub fn record(
    scenario: &Scenario,
    registry: &Registry,
    seed: u64,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<Option<ReplayData>, Error> {
    let mut simulation = Simulation::build(bare(scenario), registry, seed)?;
    let mut recorder = ReplayRecorder::new(&simulation);
    let mut stopped = false;
    let mut watch = |share| {
        stopped = !go_on(share);
        !stopped
    };
    run::run(&mut simulation, &mut [&mut recorder], &mut watch)?;
    Ok((!stopped).then_some(recorder.columns))
}
