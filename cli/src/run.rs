//! `monorig run`: simulate a scenario and report.

use crate::arguments::Run;
use crate::errors::CliError;
use crate::interrupt;
use crate::note::note;
use crate::prepare;
use crate::progress::Progress;
use crate::report;
use crate::simulate::simulate;
use crate::{Outcome, output};
use std::path::Path;

/// Simulate a scenario with one seed: the one asked for, else the first of the scenario; all of them are for tests and
/// comparisons. Nothing is written before the whole input has been found good.
pub fn run(task: &Run) -> Result<Outcome, CliError> {
    let rig = prepare::rig(&task.file, &task.overrides())?;
    prepare_out(&task.out)?;
    interrupt::listen();
    let mut progress = Progress::new(&format!("{} seed {}", rig.scenario.name, rig.seed));
    let done = simulate(rig, task, &mut |share| {
        progress.at(share);
        interrupt::go_on()
    })?;
    drop(progress);
    note(&format!("results in {}", done.folder.display()));
    output::print(&report::text(&done.summary, done.wall_s))?;
    if done.interrupted {
        return Err(CliError::Interrupted);
    }
    if !done.summary.finished {
        note("the train did not come to where the scenario ends (`stop.at_m`)");
        return Ok(Outcome::Failed);
    }
    Ok(if report::all_held(&done.summary) {
        Outcome::Held
    } else {
        Outcome::Failed
    })
}

/// The folder for results is there and can be written, found out before a long run and not after it.
pub fn prepare_out(out: &Path) -> Result<(), CliError> {
    let refused = |source| CliError::Out {
        path: out.into(),
        source,
    };
    std::fs::create_dir_all(out).map_err(refused)?;
    let probe = out.join(format!(".monorig-{}", std::process::id()));
    std::fs::write(&probe, b"can this be written?").map_err(refused)?;
    std::fs::remove_file(&probe).map_err(refused)
}
