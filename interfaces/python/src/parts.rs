//! Additions of a user to a scenario: changes, estimators by name or of their own, a controller.

use crate::control::ForeignController;
use crate::errors::{Fault, of_rig, refused};
use crate::foreign::Foreign;
use monorig_estimators::Vehicle;
use monorig_sim::closed_loop::Simulation;
use monorig_sim::closed_loop::registry::{ControllerType, EstimatorType, NamedSettings, Registry};
use monorig_sim::config::file::Sets;
use monorig_sim::config::scenario::{Scenario, Seeds};
use monorig_sim::control::ControllerSetup;
use monorig_sim::error::Error;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use std::path::{Path, PathBuf};

/// Name of a controller in Python, as a kind of controller.
const CONTROLLER: &str = "python";

/// A scenario and what a user adds to it.
pub(crate) struct Parts {
    path: PathBuf,
    /// Changes to the scenario: path and value.
    sets: Vec<(String, String)>,
    /// Estimators beside those of the scenario: name, and settings as a scenario has them; none: as they are there.
    named: Vec<(String, Option<String>)>,
    in_loop: Option<String>,
    has_controller: bool,
    pub(crate) registry: Registry,
    pub(crate) fault: Fault,
}

/// A value of Python as it would stand in a scenario.
fn json(value: &Bound<'_, PyAny>) -> PyResult<String> {
    let types = value.py().import("monorig._types")?;
    types.call_method1("json_text", (value,))?.extract()
}

impl Parts {
    /// Takes over what Python gives: changes and estimators by name; an estimator is None (ours, by its name), the name
    /// of a type, a dict of settings, or an object, a class or a function that makes one.
    pub(crate) fn new(
        path: PathBuf,
        set: Option<&Bound<'_, PyDict>>,
        estimators: Option<&Bound<'_, PyDict>>,
        controller: Option<Py<PyAny>>,
        in_loop: Option<String>,
    ) -> PyResult<Self> {
        let mut parts = Self {
            path,
            sets: Vec::new(),
            named: Vec::new(),
            in_loop,
            has_controller: controller.is_some(),
            registry: Registry::default(),
            fault: Fault::default(),
        };
        for (key, value) in set.into_iter().flatten() {
            parts.sets.push((key.extract()?, json(&value)?));
        }
        for (name, what) in estimators.into_iter().flatten() {
            parts.add(name.extract()?, &what)?;
        }
        if let Some(object) = controller {
            let fault = parts.fault.clone();
            let build = move |v: &Vehicle, setup: &ControllerSetup, _: NamedSettings<'_>| {
                ForeignController::build(&object, v, setup, &fault)
            };
            let of_python = ControllerType::new(CONTROLLER, &[], build);
            let added = parts.registry.add_controller(of_python).map(drop);
            added.map_err(|e| refused(e, "another name"))?;
        }
        Ok(parts)
    }

    fn add(&mut self, name: String, what: &Bound<'_, PyAny>) -> PyResult<()> {
        let settings = if what.is_none() {
            None
        } else if what.is_instance_of::<PyString>() {
            let settings = PyDict::new(what.py());
            settings.set_item("is", what)?;
            Some(json(&settings)?)
        } else if what.is_instance_of::<PyDict>() {
            Some(json(what)?)
        } else {
            let (object, fault) = (what.clone().unbind(), self.fault.clone());
            let build = move |v: &Vehicle, _: NamedSettings<'_>| Foreign::build(&object, v, &fault);
            let added = self.registry.add(EstimatorType::new(&name, &[], build));
            added.map(drop).map_err(|e| refused(e, "another name"))?;
            None
        };
        self.named.push((name, settings));
        Ok(())
    }

    /// Names of the estimators that were given.
    pub(crate) fn names(&self) -> Vec<String> {
        self.named.iter().map(|(name, _)| name.clone()).collect()
    }

    /// All changes to the scenario, the estimators among them.
    pub(crate) fn changes(&self) -> Result<Vec<(String, String)>, Error> {
        let mut all = self.sets.clone();
        if self.named.is_empty() && !self.has_controller && self.in_loop.is_none() {
            return Ok(all);
        }
        let there = Scenario::load(&self.path, &[])?.file;
        for (name, settings) in &self.named {
            let key = format!("estimators.{name}");
            let inside = format!("{key}.");
            let set = self
                .sets
                .iter()
                .any(|(k, _)| *k == key || k.starts_with(&inside));
            match settings {
                Some(settings) => all.push((key, settings.clone())),
                None if set || there.estimators.contains_key(name) => {}
                None => all.push((key, "{}".into())),
            }
        }
        if let Some(name) = &self.in_loop {
            all.push(("in_loop".into(), name.clone()));
        }
        let feedforward = match &self.in_loop {
            Some(_) => "\"estimate\"".to_owned(),
            // an enum without data: nothing in it can fail to serialise
            None => serde_json::to_string(&there.drive.controller.feedforward).unwrap_or_default(),
        };
        if self.has_controller {
            let settings =
                format!("{{\"kind\": \"{CONTROLLER}\", \"feedforward\": {feedforward}}}");
            all.push(("drive.controller".into(), settings));
        } else if self.in_loop.is_some() {
            all.push(("drive.controller.feedforward".into(), feedforward));
        }
        Ok(all)
    }

    /// The changes to a map file, in which estimators stand by name alone.
    pub(crate) fn changes_of_map(&self) -> Vec<(String, String)> {
        let named = self.named.iter();
        let settings = named.filter_map(|(n, s)| Some((format!("estimators.{n}"), s.clone()?)));
        self.sets.iter().cloned().chain(settings).collect()
    }

    /// The changes, as messages name them.
    pub(crate) fn sets(&self) -> Result<Sets, Error> {
        Ok(Sets::new(&self.changes()?).written_in("the call"))
    }

    /// The estimator that the controller was told to use.
    pub(crate) fn in_loop(&self) -> Option<&str> {
        self.in_loop.as_deref()
    }

    /// The file of the scenario.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The scenario, checked and built; its first seed unless there is one.
    pub(crate) fn simulation(&self, seed: Option<u64>) -> Result<Simulation, Error> {
        let scenario = Scenario::load_with(&self.path, &self.sets()?)?;
        monorig_lab::verdicts::expected::check(&scenario)?;
        let first = || scenario.seeds().first().copied().unwrap_or(1);
        let seed = seed.unwrap_or_else(first);
        let mut simulation = Simulation::build(scenario, &self.registry, seed)?;
        simulation.scenario.file.seeds = Seeds::one(seed);
        Ok(simulation)
    }
}

/// The result of a task of the rig, with the lock of the interpreter let go of while it works.
pub(crate) fn detached<T: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> Result<T, Error> + Send,
) -> PyResult<T> {
    py.detach(work).map_err(of_rig)
}
