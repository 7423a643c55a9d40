//! Studies of parameters, and their objective as a function.

use crate::errors::{Fault, defect, of_rig, refused};
use crate::run::identity;
use monorig_lab::replay::cache::Cache;
use monorig_lab::tuning::TuningStudy;
use monorig_lab::tuning::evaluate::Means;
use monorig_lab::tuning::objective::StudyObjective;
use monorig_lab::tuning::progress::Progress;
use monorig_lab::tuning::run::{self, Ended, TuningRun};
use monorig_lab::tuning::search::Begin;
use monorig_lab::tuning::trial_store::Trial;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::config::scenario::ParameterValue;
use monorig_sim::error::Error;
use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::mpsc::{Receiver, Sender, channel};

/// Hands progress to a function of Python, `(what, share)`, and lets Ctrl-C stop the search.
struct Told {
    told: Option<Py<PyAny>>,
    fault: Fault,
}

impl Told {
    fn tell(&self, what: &str, share: f64) -> bool {
        if let Some(told) = &self.told
            && let Err(e) = Python::attach(|py| told.call1(py, (what, share)).map(drop))
        {
            self.fault.keep(e);
        }
        self.fault.go_on()
    }
}

impl Progress for Told {
    fn stage(&self, name: &str, share: f64) -> bool {
        self.tell(name, share)
    }

    fn trial(&self, trial: &Trial, best: Option<&Trial>, budget: usize) -> bool {
        let n = trial.trial + 1;
        let best = best.map_or("no good trial yet".to_owned(), |b| {
            format!("best loss {:.4}", b.loss())
        });
        self.tell(
            &format!("trial {n} of {budget}, {best}"),
            n as f64 / budget as f64,
        )
    }
}

/// Runs a study as `monorig tune` does, and returns what it found as JSON.
#[pyfunction]
#[pyo3(signature = (file, folder, cache, jobs, begin, progress))]
pub(crate) fn tune(
    py: Python<'_>,
    file: PathBuf,
    folder: PathBuf,
    cache: PathBuf,
    jobs: usize,
    begin: &str,
    progress: Option<Py<PyAny>>,
) -> PyResult<String> {
    let begin = match begin {
        "new" => Begin::New,
        "resume" => Begin::Resume,
        "restart" => Begin::Restart,
        other => return Err(refused(format!("begin={other}"), "new, resume or restart")),
    };
    let (monorig, fault) = (identity(py)?, Fault::default());
    let told = Told {
        told: progress,
        fault: fault.clone(),
    };
    let done = py.detach(|| {
        let study = TuningStudy::load(&file, &Registry::default())?;
        let folder = folder.join(&study.name);
        let task = TuningRun {
            folder: folder.clone(),
            cache,
            jobs: jobs.max(1),
            begin,
            monorig,
        };
        Ok((folder, run::run(&study, &task, &told)?))
    });
    let (folder, ended) = fault.or(done)?;
    let Ended::Finished(result) = ended else {
        return Err(defect("the search was interrupted"));
    };
    let best = result
        .best()
        .map(|t| serde_json::json!({ "parameters": t.parameters, "loss": t.loss() }));
    let found = serde_json::json!({
        "folder": folder,
        "best": best,
        "trials": result.search.trials,
        "validation": result.validation,
    });
    Ok(found.to_string())
}

type Question = (
    BTreeMap<String, ParameterValue>,
    Sender<Result<Trial, Error>>,
);

/// The objective of a study: a thread holds its recordings and answers.
#[pyclass(frozen, module = "monorig._monorig")]
pub(crate) struct NativeObjective {
    ask: Mutex<Sender<Question>>,
    #[pyo3(get)]
    space_json: String,
    #[pyo3(get)]
    defaults_json: String,
}

/// Makes the runs ready, says so, and answers until nobody asks any more.
fn answer(
    study: &TuningStudy,
    cache: &Cache,
    jobs: usize,
    told: &Told,
    ready: &Sender<Result<bool, Error>>,
    questions: &Receiver<Question>,
) {
    let means = Means { cache, jobs };
    let objective = match StudyObjective::new(study, means, told) {
        Ok(Some(objective)) => objective,
        Ok(None) => return drop(ready.send(Ok(false))),
        Err(e) => return drop(ready.send(Err(e))),
    };
    let _ = ready.send(Ok(true));
    for (parameters, reply) in questions {
        let _ = reply.send(objective.score(parameters));
    }
}

#[pymethods]
impl NativeObjective {
    #[new]
    #[pyo3(signature = (file, cache, jobs, progress))]
    fn new(
        py: Python<'_>,
        file: PathBuf,
        cache: PathBuf,
        jobs: usize,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Self> {
        let (monorig, fault) = (identity(py)?, Fault::default());
        let (ask, questions) = channel();
        let (ready, is_ready) = channel();
        let told = Told {
            told: progress,
            fault: fault.clone(),
        };
        let waiting = fault.clone();
        let done = py.detach(move || {
            let study = TuningStudy::load(&file, &Registry::default())?;
            let texts = (
                study.ranges().to_string(),
                serde_json::json!(study.defaults()).to_string(),
            );
            std::thread::spawn(move || {
                let cache = Cache::new(cache, &monorig);
                answer(&study, &cache, jobs.max(1), &told, &ready, &questions);
            });
            // Ctrl-C reaches this thread alone
            let done = loop {
                match is_ready.recv_timeout(std::time::Duration::from_millis(100)) {
                    Ok(done) => break done?,
                    Err(std::sync::mpsc::RecvTimeoutError::Timeout) => drop(waiting.go_on()),
                    Err(_) => break false,
                }
            };
            Ok((done, texts))
        });
        let (true, (space_json, defaults_json)) = fault.or(done)? else {
            return Err(defect("the objective could not be prepared"));
        };
        Ok(Self {
            ask: Mutex::new(ask),
            space_json,
            defaults_json,
        })
    }

    /// The score of parameters, both JSON.
    fn score(&self, py: Python<'_>, parameters: &str) -> PyResult<String> {
        let parameters: BTreeMap<String, ParameterValue> = serde_json::from_str(parameters)
            .map_err(|e| {
                refused(
                    format!("these are not parameters: {e}"),
                    "give numbers, flags and words by name",
                )
            })?;
        let (reply, answer) = channel();
        let sent = self.ask.lock().map_err(defect)?.send((parameters, reply));
        sent.map_err(|_| defect("the thread of the objective has ended"))?;
        let trial = py
            .detach(move || answer.recv())
            .map_err(defect)?
            .map_err(of_rig)?;
        serde_json::to_string(&trial).map_err(defect)
    }
}
