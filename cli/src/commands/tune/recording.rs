//! A validation run with the defaults, the published constants and the winner side by side, for the Rerun viewer.

use crate::ui::errors::CliError;
use crate::ui::note::note;
use crate::viewer;
use monorig_lab::bound::BoundChannels;
use monorig_sim::closed_loop::{Simulation, run};
use monorig_sim::error::Error;
use monorig_sim::record::{Recorder, whole};
use std::path::Path;

/// Records the run into `before_after.rrd`, under a temporary name first, so that the file is always complete.
pub fn write(
    mut simulation: Simulation,
    folder: &Path,
    trials: usize,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<(), CliError> {
    // in a viewer it must not run together with a run of the same scenario
    simulation.scenario.name += "@before_after";
    let path = folder.join("before_after.rrd");
    let partial = whole::partial(&path);
    let Some(sink) = viewer::sink(partial.clone(), None, false) else {
        note(&viewer::not_written("before_after.rrd"));
        return Ok(());
    };
    let mut recorder = Recorder::new(vec![sink])
        .with(BoundChannels::default())
        .comparing("default", "winner");
    let recorded = run(&mut simulation, &mut [&mut recorder], go_on);
    let kept = recorded.map_err(CliError::from).and_then(|outcome| {
        if outcome.interrupted {
            return Err(CliError::TuningInterrupted(trials));
        }
        Ok(std::fs::rename(&partial, &path).map_err(Error::at(&path))?)
    });
    if kept.is_err() {
        let _ = std::fs::remove_file(&partial);
    }
    kept
}
