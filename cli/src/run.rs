//! `monorig run`: simulate a scenario, seed by seed, and report.

use crate::arguments::Run;
use crate::errors::CliError;
use crate::progress::Progress;
use crate::report::{self, Row};
use crate::{Outcome, output};
use monorig_sim::scenario::Scenario;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// Set by the first Ctrl-C; the second ends the program at once.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Simulate every seed of a scenario. Nothing is written before the whole input has been found good.
pub fn run(task: &Run) -> Result<Outcome, CliError> {
    let scenario = Scenario::load(&task.file, &task.overrides())?;
    prepare_out(&task.out)?;
    listen_for_interrupts();
    let mut rows = Vec::new();
    for &seed in scenario.seeds() {
        let name = format!("{} seed {seed}", scenario.name);
        let mut progress = Progress::new(&name, scenario.file.stop.time_limit_s());
        let end_s = simulate(&scenario, seed, task, &mut rows, &mut |t_s| {
            progress.at(t_s);
            !INTERRUPTED.load(Ordering::Relaxed)
        })?;
        if INTERRUPTED.load(Ordering::Relaxed) {
            return Err(CliError::Interrupted);
        }
        progress.done(end_s);
    }
    output::print(&report::table(&rows))?;
    Ok(match report::all_held(&rows) {
        true => Outcome::Held,
        false => Outcome::Failed,
    })
}

/// Simulate one seed: results go below `task.out`, numbers to `rows`; `go_on` is told the simulated time and says whether
/// to go on. Gives the simulated time at the end.
fn simulate(
    _scenario: &Scenario,
    _seed: u64,
    task: &Run,
    _rows: &mut Vec<Row>,
    _go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<f64, CliError> {
    // The one place where the simulation is called; it is not part of this build yet.
    let _ = (task.live, task.no_rerun);
    Err(CliError::NoSimulation)
}

/// The folder for results is there and can be written, found out before a long run and not after it.
fn prepare_out(out: &Path) -> Result<(), CliError> {
    let refused = |source| CliError::Out {
        path: out.into(),
        source,
    };
    std::fs::create_dir_all(out).map_err(refused)?;
    let probe = out.join(format!(".monorig-{}", std::process::id()));
    std::fs::write(&probe, b"can this be written?").map_err(refused)?;
    std::fs::remove_file(&probe).map_err(refused)
}

fn listen_for_interrupts() {
    let heard = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
    if let Err(e) = heard {
        output::note(&format!("Ctrl-C will end the program at once: {e}"));
    }
}
