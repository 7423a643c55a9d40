//! Lists of runs that answer one question together: a stress battery, an error budget.

use crate::batch::results;
use crate::errors::{defect, refused};
use crate::parts::Parts;
use crate::run::identity;
use monorig_lab::batch::{Interrupted, RunSpec, run_one};
use monorig_lab::campaign::Campaign;
use monorig_lab::explain::{Budget, Source, sources};
use monorig_lab::stress::{Battery, Condition, Pairing, StressFile, StressRun};
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::config::file::Sets;
use monorig_sim::record::identity::Identity;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Serialize;
use serde_json::json;
use std::path::PathBuf;

/// The runs by their index, each a line of JSON, and what they come to.
#[pyclass(frozen, module = "monorig._monorig")]
pub(crate) struct NativeSeries {
    parts: Parts,
    purpose: Purpose,
}

/// The purpose of the runs.
enum Purpose {
    Stress(Box<Battery>, Box<Campaign>),
    Explain {
        name: String,
        seeds: Vec<u64>,
        sources: Vec<Source>,
        specs: Vec<RunSpec>,
        monorig: Identity,
    },
}

fn line(of: &impl Serialize) -> Result<String, String> {
    serde_json::to_string(of).map_err(|e| e.to_string())
}

impl Purpose {
    /// Makes the run of this index.
    fn run(
        &self,
        index: usize,
        registry: &Registry,
        go_on: &dyn Fn() -> bool,
    ) -> Result<String, String> {
        let stopped = |_: Interrupted| "interrupted".to_owned();
        match self {
            Self::Stress(battery, _) => {
                let run = battery.run(index as u64, registry, go_on);
                line(&run.map_err(stopped)?)
            }
            Self::Explain { specs, .. } => {
                let spec = specs.get(index).ok_or("there is no such run")?;
                line(&run_one(spec, registry, go_on).map_err(stopped)?)
            }
        }
    }
}

#[pymethods]
impl NativeSeries {
    #[getter]
    fn count(&self) -> u64 {
        match &self.purpose {
            Purpose::Stress(battery, _) => battery.runs(),
            Purpose::Explain { specs, .. } => specs.len() as u64,
        }
    }
    /// Makes the run of this index.
    fn run(&self, py: Python<'_>, index: usize) -> PyResult<String> {
        let fault = &self.parts.fault;
        let go_on = || fault.go_on();
        let done = py.detach(|| self.purpose.run(index, &self.parts.registry, &go_on));
        fault.or(Ok(()))?;
        done.map_err(defect)
    }
    /// Returns the result of all runs, as JSON.
    fn result(&self, runs: Vec<String>) -> PyResult<String> {
        match &self.purpose {
            Purpose::Stress(_, campaign) => {
                let runs = runs.iter().map(|run| serde_json::from_str(run));
                let runs = runs.collect::<Result<Vec<StressRun>, _>>();
                Ok(StressFile::new(campaign, runs.map_err(defect)?).to_json())
            }
            Purpose::Explain {
                name,
                seeds,
                sources,
                monorig,
                ..
            } => {
                let (monorig, runs) = (monorig.to_string(), results(&runs)?);
                let budget = Budget::new(monorig, name.clone(), seeds.clone(), sources, &runs);
                if budget.errors.is_empty() {
                    let broken = runs.iter().find_map(|r| r.error.as_deref());
                    let why = broken
                        .unwrap_or("no estimator has an error after the start of the metrics");
                    return Err(refused(
                        why,
                        "a scenario with estimators that comes to its end",
                    ));
                }
                let (estimator, sentence) = budget.sentence(self.parts.in_loop());
                let told = json!({"estimator": estimator, "sentence": sentence, "budget": budget});
                Ok(told.to_string())
            }
        }
    }
}

/// The runs of a battery: scenarios without and under each of the conditions.
#[pyfunction]
#[pyo3(signature = (paths, folders, only, set, estimators))]
pub(crate) fn stress(
    py: Python<'_>,
    paths: Vec<PathBuf>,
    folders: Vec<PathBuf>,
    only: Vec<String>,
    set: Option<&Bound<'_, PyDict>>,
    estimators: Option<&Bound<'_, PyDict>>,
) -> PyResult<(NativeSeries, Vec<String>)> {
    let parts = Parts::new(PathBuf::new(), set, estimators, None, None)?;
    let monorig = identity(py)?;
    let made = py.detach(|| {
        let mut conditions = Condition::load_all(&folders)?;
        conditions.retain(|c| only.is_empty() || only.iter().any(|text| c.is_called(text)));
        let wanted: Vec<_> = parts.names().into_iter().map(|name| (name, None)).collect();
        let sets = parts.changes_of_map();
        let every = Pairing::Every;
        Battery::load(&paths, conditions, every, &wanted, &sets, &parts.registry)
    });
    let battery = parts.fault.or(made)?;
    let left_out = battery.left_out().to_vec();
    let campaign = battery.campaign(&monorig);
    let purpose = Purpose::Stress(Box::new(battery), Box::new(campaign));
    Ok((NativeSeries { parts, purpose }, left_out))
}

/// The runs of an error budget: a scenario as it is, then without each source of error.
#[pyfunction]
#[pyo3(signature = (path, seeds, set, estimators, controller, in_loop))]
pub(crate) fn explain(
    py: Python<'_>,
    path: PathBuf,
    seeds: Option<Vec<u64>>,
    set: Option<&Bound<'_, PyDict>>,
    estimators: Option<&Bound<'_, PyDict>>,
    controller: Option<Py<PyAny>>,
    in_loop: Option<String>,
) -> PyResult<NativeSeries> {
    let parts = Parts::new(path, set, estimators, controller, in_loop)?;
    let monorig = identity(py)?;
    let made = py.detach(|| {
        let changes = parts.changes()?;
        let scenario = parts.simulation(None)?.scenario;
        let first = scenario.seeds().first().copied().unwrap_or(1);
        let seeds = seeds.unwrap_or_else(|| (first..first.saturating_add(5)).collect());
        let sources = sources(&scenario)?;
        let inputs = scenario.inputs();
        inputs.seal();
        let nothing = Vec::new();
        let off = std::iter::once(&nothing).chain(sources.iter().map(|s| &s.changes));
        let specs = off.flat_map(|off| {
            let all = Sets::new(&[changes.as_slice(), off.as_slice()].concat());
            seeds.iter().map(move |seed| (all.clone(), *seed))
        });
        let spec = |(index, (sets, seed))| RunSpec::new(index, parts.path(), seed, sets, inputs);
        let specs = (0..).zip(specs).map(spec).collect();
        Ok((scenario.name, seeds, sources, specs))
    });
    let (name, seeds, sources, specs) = parts.fault.or(made)?;
    let purpose = Purpose::Explain {
        name,
        seeds,
        sources,
        specs,
        monorig,
    };
    Ok(NativeSeries { parts, purpose })
}
