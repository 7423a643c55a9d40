//! The files of a run with their manifest, as `monorig run` writes them.

use crate::bound::BoundChannels;
use crate::verdicts::measure::SummaryObserver;
use crate::verdicts::summary::Summary;
use monorig_sim::closed_loop::run::Observer;
use monorig_sim::closed_loop::{Registry, Simulation, resolved};
use monorig_sim::error::Error;
use monorig_sim::record::Recorder;
use monorig_sim::record::folder::RunFolder;
use monorig_sim::record::identity::Identity;
use monorig_sim::record::manifest::{self, Manifest};
use monorig_sim::record::parquet::ParquetSink;
use std::path::{Path, PathBuf};

/// Name of the file with the columns of a run.
pub const CHANNELS: &str = "channels.parquet";

/// Folder of a run during writing, and its manifest.
pub struct RunFiles {
    folder: RunFolder,
    manifest: Manifest,
}

impl RunFiles {
    /// Makes the folder `out/NAME/SEED` of this simulation, under another name until it is complete. `changes`: those
    /// to the scenario file, as `path=value`.
    pub fn create(
        out: &Path,
        simulation: &Simulation,
        registry: &Registry,
        program: &Identity,
        changes: &[String],
    ) -> Result<Self, Error> {
        let (scenario, seed) = (&simulation.scenario, simulation.seed);
        let folder = RunFolder::create(out, &scenario.name, seed)?;
        let (inputs, resolved) = (scenario.input_digests(), resolved(scenario, registry));
        let mut manifest = Manifest::new(program, &scenario.name, seed, inputs, resolved);
        manifest.changes = changes.to_vec();
        Ok(Self { folder, manifest })
    }

    /// Path of a file until the run is complete.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes metrics and manifest, and moves the folder to its place.
    pub fn finish(mut self, summary: &Summary, interrupted: bool) -> Result<PathBuf, Error> {
        let folder = self.folder;
        folder.write("metrics.json", summary.to_json().as_bytes())?;
        self.manifest.sum_outputs(folder.path())?;
        folder.write(manifest::NAME, self.manifest.to_json().as_bytes())?;
        match interrupted {
            false => folder.commit(),
            true => folder.commit_interrupted(),
        }
    }
}

/// Runs a simulation to its end with your own observers, and writes the folder `out/NAME/SEED` with columns, metrics
/// and manifest: `monorig report`, `runs` and `export` take it like that of `monorig run`. The registry is the one that
/// the simulation was built with. Returns the metrics and the folder.
pub fn record(
    simulation: &mut Simulation,
    registry: &Registry,
    out: &Path,
    observers: &mut [&mut dyn Observer],
) -> Result<(Summary, PathBuf), Error> {
    let program = Identity::of_program(None);
    let files = RunFiles::create(out, simulation, registry, &program, &[])?;
    let sink = ParquetSink::create(files.path(CHANNELS))?;
    let mut recorder = Recorder::new(vec![Box::new(sink)]).with(BoundChannels::default());
    let mut metrics = SummaryObserver::default();
    let mut all: Vec<&mut dyn Observer> = vec![&mut recorder, &mut metrics];
    for observer in observers {
        all.push(&mut **observer);
    }
    let outcome = simulation.run(&mut all)?;
    let summary = metrics.summary(&simulation.scenario, simulation.seed, &outcome);
    let folder = files.finish(&summary, outcome.interrupted)?;
    Ok((summary, folder))
}
