//! A scenario or a log from begin to end.

use crate::class::python_class;
use crate::columns::{Columns, Kept};
use crate::errors::{Fault, defect};
use crate::parts::{Parts, detached};
use crate::table::{Table, read};
use arrow_array::RecordBatch;
use monorig_lab::bound::BoundChannels;
use monorig_lab::reports::run as report;
use monorig_lab::verdicts::measure::SummaryObserver;
use monorig_lab::verdicts::run_files::CHANNELS;
use monorig_lab::verdicts::summary::Summary;
use monorig_logs::export::{SAMPLES, SampleRecorder};
use monorig_logs::map::Map;
use monorig_logs::replay::{ReplayOptions, build};
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::run::{self as the_loop, Observer, Outcome};
use monorig_sim::closed_loop::{Simulation, resolved};
use monorig_sim::config::file::{input_error, read_result};
use monorig_sim::error::Error;
use monorig_sim::record::folder::RunFolder;
use monorig_sim::record::identity::Identity;
use monorig_sim::record::manifest::{self, Manifest};
use monorig_sim::record::parquet::ParquetSink;
use monorig_sim::record::{Recorder, readback};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Names of files in the folder of a run.
const METRICS: &str = "metrics.json";
const RECORDING: &str = "run.rrd";

/// The place of the files of a run.
enum Source {
    /// Nowhere yet: they are made of what was recorded. A temporary folder has the samples, if they are kept.
    Memory(Box<Kept>, Option<TempDir>),
    /// The folder of a run that was kept.
    Folder(PathBuf, Box<Manifest>),
}

/// The result of a run.
#[pyclass(frozen, module = "monorig._monorig")]
pub(crate) struct NativeRun {
    batch: RecordBatch,
    source: Source,
    events: Vec<(i64, String)>,
    samples: Option<RecordBatch>,
    summary: Summary,
    changes: Vec<String>,
    inputs: BTreeMap<String, String>,
    resolved: serde_json::Value,
}

/// A run in progress: the observers of what it leaves.
pub(crate) struct Observers {
    pub(crate) recorder: Recorder<'static>,
    pub(crate) metrics: SummaryObserver,
    columns: Columns,
    changes: Vec<String>,
    inputs: BTreeMap<String, String>,
    resolved: serde_json::Value,
}

impl Observers {
    /// Of a simulation with these changes, whose parts are those of the registry.
    pub(crate) fn new(
        simulation: &Simulation,
        changes: &[(String, String)],
        registry: &Registry,
    ) -> Self {
        let columns = Columns::default();
        let recorder =
            Recorder::new(vec![Box::new(columns.clone())]).with(BoundChannels::default());
        Self {
            recorder,
            metrics: SummaryObserver::default(),
            columns,
            changes: changes
                .iter()
                .map(|(key, x)| format!("{key}={x}"))
                .collect(),
            inputs: simulation.scenario.input_digests(),
            resolved: resolved(&simulation.scenario, registry),
        }
    }

    /// The result, once the run is over.
    pub(crate) fn left(
        self,
        simulation: &Simulation,
        outcome: &Outcome,
        samples: Option<TempDir>,
    ) -> Result<NativeRun, Error> {
        let kept = self.columns.take();
        let table = |folder: &TempDir| read(&folder.path().join(SAMPLES));
        let batch = kept.batch().map_err(|what| Error::Broken {
            t_s: outcome.simulated_s,
            what,
        })?;
        Ok(NativeRun {
            batch,
            events: kept.events(),
            samples: samples.as_ref().map(table).transpose()?,
            source: Source::Memory(Box::new(kept), samples),
            summary: self
                .metrics
                .summary(&simulation.scenario, simulation.seed, outcome),
            changes: self.changes,
            inputs: self.inputs,
            resolved: self.resolved,
        })
    }
}

/// Runs a simulation to its end.
fn to_its_end(
    mut simulation: Simulation,
    changes: &[(String, String)],
    registry: &Registry,
    keep_samples: bool,
    fault: &Fault,
) -> Result<NativeRun, Error> {
    let mut observers = Observers::new(&simulation, changes, registry);
    let folder = keep_samples.then(tempfile::tempdir).transpose();
    let folder = folder.map_err(Error::at(&std::env::temp_dir()))?;
    let file = folder.as_ref().map(|f| f.path().join(SAMPLES));
    let mut samples = file.as_ref().map(SampleRecorder::new);
    let mut watch = fault.clone();
    let outcome = {
        let mut all: Vec<&mut dyn Observer> =
            vec![&mut watch, &mut observers.recorder, &mut observers.metrics];
        if let Some(samples) = &mut samples {
            all.push(samples);
        }
        the_loop::run(&mut simulation, &mut all, &mut |_| fault.go_on())?
    };
    observers.left(&simulation, &outcome, folder)
}

/// Runs a scenario.
#[pyfunction]
#[pyo3(signature = (path, seed, set, estimators, controller, in_loop, keep_samples))]
#[allow(clippy::too_many_arguments)]
pub(crate) fn run(
    py: Python<'_>,
    path: PathBuf,
    seed: Option<u64>,
    set: Option<&Bound<'_, PyDict>>,
    estimators: Option<&Bound<'_, PyDict>>,
    controller: Option<Py<PyAny>>,
    in_loop: Option<String>,
    keep_samples: bool,
) -> PyResult<NativeRun> {
    let parts = Parts::new(path, set, estimators, controller, in_loop)?;
    let done = py.detach(|| {
        let simulation = parts.simulation(seed)?;
        to_its_end(
            simulation,
            &parts.changes()?,
            &parts.registry,
            keep_samples,
            &parts.fault,
        )
    });
    parts.fault.or(done)
}

/// Plays a recorded log to estimators.
#[pyfunction]
#[pyo3(signature = (log, map, estimators, set))]
pub(crate) fn replay(
    py: Python<'_>,
    log: Option<PathBuf>,
    map: PathBuf,
    estimators: Option<&Bound<'_, PyDict>>,
    set: Option<&Bound<'_, PyDict>>,
) -> PyResult<NativeRun> {
    let parts = Parts::new(map, set, estimators, None, None)?;
    let done = py.detach(|| {
        let changes = parts.changes_of_map();
        let map = Map::load_with(parts.path(), log.as_deref(), &changes)?;
        let options = ReplayOptions {
            estimators: parts.names(),
            ..ReplayOptions::default()
        };
        let simulation = build(&map, &options, &parts.registry)?.simulation;
        monorig_lab::verdicts::expected::check(&simulation.scenario)?;
        to_its_end(simulation, &changes, &parts.registry, false, &parts.fault)
    });
    parts.fault.or(done)
}

/// This module as the program that makes a run.
pub(crate) fn identity(py: Python<'_>) -> PyResult<Identity> {
    let file: PathBuf = py
        .import("monorig._monorig")?
        .getattr("__file__")?
        .extract()?;
    Ok(Identity::of_library(&file, option_env!("MONORIG_REVISION")))
}

/// The run that a folder holds, as the program or `save` has left it there.
#[pyfunction]
pub(crate) fn load(py: Python<'_>, folder: PathBuf) -> PyResult<NativeRun> {
    detached(py, || {
        let manifest = Manifest::of_run(&folder)?;
        let path = folder.join(METRICS);
        let broken = |what: String| input_error(&path, "", what, "make the run again");
        let summary: Summary =
            serde_json::from_str(&read_result(&path)?).map_err(|e| broken(e.to_string()))?;
        summary.check().map_err(broken)?;
        let table = |name: &str| {
            manifest.verify(&folder, name)?;
            read(&folder.join(name))
        };
        let has_samples = manifest.outputs.contains_key(SAMPLES);
        Ok(NativeRun {
            batch: table(CHANNELS)?,
            events: readback::read(&folder.join(CHANNELS))?.events,
            samples: has_samples.then(|| table(SAMPLES)).transpose()?,
            summary,
            changes: manifest.changes.clone(),
            inputs: manifest.inputs.clone(),
            resolved: manifest.resolved.clone(),
            source: Source::Folder(folder, Box::new(manifest)),
        })
    })
}

/// Writes the recording for the viewer; false in a module that was built without it.
#[cfg(feature = "viewer")]
fn record(kept: &Kept, path: &Path) -> Result<bool, Error> {
    kept.write(&mut monorig_viz::RerunSink::file(path).thinned())?;
    Ok(true)
}
#[cfg(not(feature = "viewer"))]
fn record(_: &Kept, _: &Path) -> Result<bool, Error> {
    Ok(false)
}

impl NativeRun {
    /// Writes the files of the run into a folder, with a recording for the viewer if it is wanted.
    fn write(&self, folder: &Path, monorig: &Identity, recording: bool) -> Result<String, Error> {
        let (kept, samples) = match &self.source {
            Source::Memory(kept, samples) => (kept, samples),
            Source::Folder(from, manifest) => {
                for name in manifest.outputs.keys() {
                    let copied = std::fs::copy(from.join(name), folder.join(name));
                    copied.map_err(Error::at(&from.join(name)))?;
                }
                return Ok(manifest.to_json());
            }
        };
        kept.write(&mut ParquetSink::create(folder.join(CHANNELS))?)?;
        if recording {
            record(kept, &folder.join(RECORDING))?;
        }
        if let Some(from) = samples {
            let copied = std::fs::copy(from.path().join(SAMPLES), folder.join(SAMPLES));
            copied.map_err(Error::at(folder))?;
        }
        let path = folder.join(METRICS);
        std::fs::write(&path, self.summary.to_json()).map_err(Error::at(&path))?;
        let (inputs, resolved) = (self.inputs.clone(), self.resolved.clone());
        let (name, seed) = (&self.summary.scenario, self.summary.seed);
        let mut manifest = Manifest::new(monorig, name, seed, inputs, resolved);
        manifest.changes = self.changes.clone();
        manifest.sum_outputs(folder)?;
        Ok(manifest.to_json())
    }
}

python_class! {
    NativeRun, self => {
        channels: Table = Table(self.batch.clone());
        samples: Option<Table> = self.samples.clone().map(Table);
        summary_json: String = self.summary.to_json();
        resolved_json: String = self.resolved.to_string();
        good: bool = self.summary.good();
        verdict: String = self.summary.verdict().judgement().words();
        failures: Vec<String> = crate::batch::failures(&self.summary.verdict());
        finished: bool = self.summary.finished;
        refusals: Vec<(String, u64, String)> = self.summary.refusals.clone();
    }
    #[getter]
    fn events(&self) -> Vec<(f64, String)> {
        let events = self.events.iter();
        events
            .map(|(ns, text)| (*ns as f64 * 1e-9, text.clone()))
            .collect()
    }
    /// Writes the folder of the run below `out`, as `monorig run` does, and returns it.
    fn save(&self, py: Python<'_>, out: PathBuf, recording: bool) -> PyResult<PathBuf> {
        let monorig = identity(py)?;
        detached(py, || {
            let folder = RunFolder::create(&out, &self.summary.scenario, self.summary.seed)?;
            let manifest = self.write(folder.path(), &monorig, recording)?;
            folder.write(manifest::NAME, manifest.as_bytes())?;
            folder.commit()
        })
    }
    /// Writes the recording for the viewer; false if there is none.
    fn record(&self, py: Python<'_>, path: PathBuf) -> PyResult<bool> {
        detached(py, || match &self.source {
            Source::Memory(kept, _) => record(kept, &path),
            Source::Folder(folder, manifest) if manifest.outputs.contains_key(RECORDING) => {
                let copied = std::fs::copy(folder.join(RECORDING), &path);
                copied.map(|_| true).map_err(Error::at(&path))
            }
            Source::Folder(..) => Ok(false),
        })
    }
    /// The report as HTML.
    fn report_html(&self, py: Python<'_>) -> PyResult<String> {
        let monorig = identity(py)?;
        let folder = tempfile::tempdir().map_err(defect)?;
        detached(py, || {
            let manifest = self.write(folder.path(), &monorig, false)?;
            let path = folder.path().join(manifest::NAME);
            std::fs::write(&path, manifest).map_err(Error::at(&path))?;
            Ok(report::page(folder.path(), "")?.to_html())
        })
    }
}
