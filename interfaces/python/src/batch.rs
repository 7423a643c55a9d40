//! Many runs: the result of each as a line of JSON, which goes from process to process, and what follows from them.

use crate::errors::{defect, refused};
use crate::parts::{Parts, detached};
use monorig_lab::batch::{RunSpec, run_one as one};
use monorig_lab::metrics::{estimator_metrics, run_metrics};
use monorig_lab::verdicts::compare as comparison;
use monorig_lab::verdicts::run_result::RunResult;
use monorig_lab::verdicts::verdict::{Check, ScenarioVerdict};
use monorig_sim::config::file::Document;
use monorig_sim::config::kinds::kind_of;
use monorig_sim::config::scenario::Scenario;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// Runs a scenario with a seed; the result as JSON. A run that breaks down is a result too, an exception is not.
#[pyfunction]
#[pyo3(signature = (path, seed, set, estimators, controller, in_loop, reference))]
#[allow(clippy::too_many_arguments)]
pub(crate) fn run_one(
    py: Python<'_>,
    path: PathBuf,
    seed: u64,
    set: Option<&Bound<'_, PyDict>>,
    estimators: Option<&Bound<'_, PyDict>>,
    controller: Option<Py<PyAny>>,
    in_loop: Option<String>,
    reference: Option<String>,
) -> PyResult<String> {
    let parts = Parts::new(path, set, estimators, controller, in_loop)?;
    let done = py.detach(|| {
        let spec = RunSpec {
            index: 0,
            scenario: parts.path().into(),
            changes: parts.sets()?,
            inputs: Default::default(),
            seed,
            draws: Default::default(),
            reference,
        };
        Ok(one(&spec, &parts.registry, &|| parts.fault.go_on()))
    });
    match parts.fault.or(done)? {
        Ok(result) => serde_json::to_string(&result).map_err(defect),
        // without an exception nothing stops it
        Err(_) => Err(defect("interrupted")),
    }
}

/// Name, seeds and estimators of a scenario with what is added, checked by building it.
#[pyfunction]
#[pyo3(signature = (path, set, estimators, controller, in_loop))]
pub(crate) fn outline(
    py: Python<'_>,
    path: PathBuf,
    set: Option<&Bound<'_, PyDict>>,
    estimators: Option<&Bound<'_, PyDict>>,
    controller: Option<Py<PyAny>>,
    in_loop: Option<String>,
) -> PyResult<(String, Vec<u64>, Vec<String>)> {
    let parts = Parts::new(path, set, estimators, controller, in_loop)?;
    let built = py.detach(|| {
        let scenario = Scenario::load_with(parts.path(), &parts.sets()?)?;
        let seeds = scenario.seeds().to_vec();
        let simulation = parts.simulation(None)?;
        let names = simulation.estimators.iter().map(|e| e.name.clone());
        Ok((scenario.name, seeds, names.collect()))
    });
    parts.fault.or(built)
}

/// The results of runs, from their lines of JSON.
pub(crate) fn results(runs: &[String]) -> PyResult<Vec<RunResult>> {
    let read = runs.iter().zip(0..).map(|(line, index)| {
        let run: RunResult = serde_json::from_str(line)?;
        Ok::<_, serde_json::Error>(RunResult { index, ..run })
    });
    let read: Result<Vec<RunResult>, _> = read.collect();
    read.map_err(|e| {
        refused(
            format!("this is not the result of a run: {e}"),
            "use the `runs` of a study",
        )
    })
}

/// Every metric of every estimator over the runs, against the reference; JSON.
#[pyfunction]
pub(crate) fn compare(
    py: Python<'_>,
    runs: Vec<String>,
    estimators: Vec<String>,
    metrics: Vec<String>,
    reference: String,
    path: PathBuf,
) -> PyResult<String> {
    let known: Vec<&str> = estimator_metrics().map(|m| m.name).collect();
    for name in &metrics {
        if !known.contains(&name.as_str()) {
            let near = monorig_sim::config::file::nearest(name, known.iter().copied());
            let help = near.map_or("`metrics()` lists them".to_owned(), |near| {
                format!("did you mean `{near}`?")
            });
            return Err(refused(format!("estimators have no metric `{name}`"), help));
        }
    }
    let runs = results(&runs)?;
    let metrics = match metrics.is_empty() {
        true => comparison::usual_metrics(&runs),
        false => metrics,
    };
    let table = detached(py, || {
        let published = Scenario::load(&path, &[])?.file.published;
        Ok(comparison::compare(
            &runs,
            &estimators,
            &metrics,
            &reference,
            &published,
        ))
    })?;
    serde_json::to_string(&table).map_err(defect)
}

/// The failures of a verdict, each in a line.
pub(crate) fn failures(verdict: &ScenarioVerdict) -> Vec<String> {
    let failed = verdict.checks.iter().filter(|c| !c.held);
    failed.map(Check::reason).collect()
}

/// The verdict on a scenario from its runs; JSON.
#[pyfunction]
pub(crate) fn judge(scenario: &str, runs: Vec<String>) -> PyResult<String> {
    let judged = ScenarioVerdict::new(scenario, results(&runs)?);
    let judged = serde_json::json!({
        "held": judged.held,
        "verdict": judged.judgement().words(),
        "failures": failures(&judged),
        "checks": judged.checks,
    });
    serde_json::to_string(&judged).map_err(defect)
}

/// The metrics of estimators and those of the run: name and unit.
#[pyfunction]
pub(crate) fn metrics() -> Vec<(&'static str, &'static str)> {
    let all = estimator_metrics().chain(run_metrics());
    all.map(|m| (m.name, m.unit)).collect()
}

/// The kind of a file of ours, such as `scenario`; None if its keys do not decide it.
#[pyfunction]
pub(crate) fn kind(path: PathBuf) -> Option<&'static str> {
    let document = Document::read(&path).ok()?;
    kind_of(&document.keys())
}

/// The place of an estimator in a palette: the same as in reports and in the viewer.
#[pyfunction]
pub(crate) fn colour_place(name: &str) -> usize {
    monorig_sim::record::palette::place(name)
}
