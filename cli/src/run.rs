//! `monorig run`: simulate a scenario and report.

use crate::arguments::Run;
use crate::errors::CliError;
use crate::progress::Progress;
use crate::report;
use crate::output::note;
use crate::prepare;
use crate::simulate::simulate;
use crate::{Outcome, output};
use monorig_sim::scenario::Scenario;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// Set by the first Ctrl-C; the second ends the program at once.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Simulate a scenario. Nothing is written before the whole input has been found good.
pub fn run(task: &Run) -> Result<Outcome, CliError> {
    let scenario = prepare::scenario(&task.file, &task.overrides())?;
    prepare_out(&task.out)?;
    listen_for_interrupts();
    let mut held = true;
    for &seed in seeds(&scenario, task) {
        let mut progress = Progress::new(&format!("{} seed {seed}", scenario.name));
        let done = simulate(&scenario, seed, task, &mut |share| {
            progress.at(share);
            !INTERRUPTED.load(Ordering::Relaxed)
        })?;
        drop(progress);
        note(&format!("results in {}", done.folder.display()));
        output::print(&report::text(&done.summary, &scenario.file.expect, done.wall_s))?;
        if !done.summary.finished {
            return Err(CliError::Interrupted);
        }
        held &= report::all_held(&done.summary);
    }
    Ok(if held { Outcome::Held } else { Outcome::Failed })
}

/// The seed asked for, else the first of the scenario: all of them are for tests and comparisons.
fn seeds<'a>(scenario: &'a Scenario, task: &Run) -> &'a [u64] {
    let all = scenario.seeds();
    if task.seed.is_some() { all } else { all.get(..1).unwrap_or(all) }
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
