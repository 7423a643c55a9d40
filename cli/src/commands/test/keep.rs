//! `--keep-failed`: the worst run of every scenario that fails, recorded, with its report.

use crate::files::{prepare, report};
use crate::recording::simulate::{RecordOptions, simulate};
use crate::recording::variant::Variant;
use crate::ui::errors::CliError;
use crate::ui::interrupt;
use crate::ui::note::note;
use crate::verdicts::{TestedScenario, lines};
use monorig_sim::closed_loop::registry::Registry;
use std::path::Path;

/// Run a failed scenario again with its worst seed, into `DIR/<scenario>/<seed>/`, and write the report. A scenario
/// that held is left out.
pub fn worst_run(
    tested: &TestedScenario,
    scenario: &Path,
    sets: &[(String, String)],
    folder: &Path,
    registry: &Registry,
) -> Result<(), CliError> {
    let Some(seed) = lines::worst_seed(&tested.judged) else {
        return Ok(());
    };
    let variant = Variant::new(sets, None);
    let mut all = sets.to_vec();
    all.push(("seeds".into(), seed.to_string()));
    let mut simulation = prepare::simulation(scenario, &all, registry)?;
    simulation.scenario.name = variant.run_name(&simulation.scenario.name);
    let options = RecordOptions {
        out: folder,
        live: None,
        pace: None,
        no_rerun: false,
        full_rate: false,
        keep_samples: false,
        changes: &variant.changes,
        registry,
    };
    let run = match simulate(simulation, &options, &mut |_| interrupt::go_on()) {
        Err(CliError::Sim(e)) => {
            let scenario = &tested.judged.scenario;
            note(&format!("{scenario} seed {seed} cannot be kept: {e}"));
            return Ok(());
        }
        run => run?,
    };
    if run.interrupted {
        return Err(CliError::Interrupted);
    }
    let page = report::of_run(&run.folder)?;
    note(&format!(
        "{} seed {seed}: kept, {}",
        tested.judged.scenario,
        page.display()
    ));
    Ok(())
}
