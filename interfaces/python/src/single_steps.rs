//! A run that the user steps.

use crate::class::python_class;
use crate::control::{Perception, Reference};
use crate::errors::{defect, of_rig, refused};
use crate::parts::Parts;
use crate::run::{NativeRun, Observers};
use crate::signals::{Command, Estimate, Measurements};
use crate::vehicle::Vehicle;
use monorig_estimators::api::signals;
use monorig_sim::closed_loop::Simulation;
use monorig_sim::closed_loop::run::{Observer, Outcome, Seen, StepFrame, Steps};
use monorig_sim::error::Error;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// A simulation between two steps. It belongs to the thread that made it.
#[pyclass(unsendable, module = "monorig._monorig")]
pub(crate) struct NativeSimulation {
    simulation: Simulation,
    steps: Steps,
    seen: Seen,
    /// None once the run is left.
    observers: Option<Observers>,
    outcome: Option<Outcome>,
    parts: Parts,
}

/// The state after a step.
#[pyclass(frozen, module = "monorig", skip_from_py_object)]
pub(crate) struct Frame {
    z: signals::Measurements,
    command: signals::Command,
    drives: usize,
    estimates: Vec<(String, signals::Estimate)>,
    truth: [f64; 6],
    #[pyo3(get)]
    sampled: bool,
    #[pyo3(get)]
    events: Vec<String>,
}

/// Names of what is shown of the truth.
const TRUTH: [&str; 6] = [
    "time_s",
    "chainage_m",
    "speed_mps",
    "grade_at_imu_rad",
    "grade_effective_rad",
    "total_mass_kg",
];

/// Keeps the last state.
#[derive(Default)]
struct Last(Option<Frame>);

impl Observer for Last {
    fn on_step(&mut self, f: &StepFrame<'_>) -> Result<(), Error> {
        let t = f.truth;
        self.0 = Some(Frame {
            z: *f.measurements,
            command: *f.command,
            drives: t.drives.len(),
            estimates: f
                .estimators
                .iter()
                .map(|e| (e.name.clone(), e.estimate))
                .collect(),
            truth: [
                t.t_s,
                t.chainage_m,
                t.speed_mps,
                t.grade_at_imu_rad,
                t.grade_effective_rad,
                t.total_mass_kg,
            ],
            sampled: f.sampled,
            events: f.events.to_vec(),
        });
        Ok(())
    }
}

#[pymethods]
impl Frame {
    #[getter]
    fn time_s(&self) -> f64 {
        self.z.t.s()
    }
    #[getter]
    fn measurements(&self) -> Measurements {
        Measurements {
            z: self.z,
            u: self.command,
            drives: self.drives,
        }
    }
    #[getter]
    fn estimates<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for (name, estimate) in &self.estimates {
            all.set_item(name, Estimate(*estimate))?;
        }
        Ok(all)
    }
    #[getter]
    fn truth<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for (name, x) in TRUTH.iter().zip(self.truth) {
            all.set_item(name, x)?;
        }
        Ok(all)
    }
    fn __repr__(&self) -> String {
        format!(
            "Frame(time_s={}, speed_mps={})",
            self.truth[0], self.truth[2]
        )
    }
}

impl NativeSimulation {
    /// Looks at the step to come, or finds that the run is over.
    fn look(&mut self) -> PyResult<()> {
        let fault = self.parts.fault.clone();
        let ended = self.steps.ended(&self.simulation, &mut |_| fault.go_on());
        match fault.or(ended)? {
            None => self.seen = self.steps.look(&mut self.simulation),
            over => self.outcome = over,
        }
        Ok(())
    }
}

python_class! {
    NativeSimulation, self => {
        over: bool = self.outcome.is_some();
        time_s: f64 = self.simulation.plant.truth().t_s;
        dt_s: f64 = self.simulation.dt_s;
        seed: u64 = self.simulation.seed;
        motor_torque_max_nm: f64 = self.simulation.train.drives.first().map_or(0.0, |d| d.torque_max_nm);
        vehicle: Vehicle = Vehicle(self.simulation.vehicle);
        reference: Reference = (&self.seen.reference).into();
        perception: Perception = Perception::of(&self.seen.perception, self.simulation.vehicle.drives);
    }
    #[new]
    #[pyo3(signature = (path, seed, set, estimators, controller, in_loop))]
    fn new(
        path: PathBuf,
        seed: Option<u64>,
        set: Option<&Bound<'_, PyDict>>,
        estimators: Option<&Bound<'_, PyDict>>,
        controller: Option<Py<PyAny>>,
        in_loop: Option<String>,
    ) -> PyResult<Self> {
        let parts = Parts::new(path, set, estimators, controller, in_loop)?;
        let simulation = parts.fault.or(parts.simulation(seed))?;
        let changes = parts.changes().map_err(of_rig)?;
        let mut observers = Observers::new(&simulation, &changes, &parts.registry);
        let begun = observers.recorder.begin(&simulation);
        begun
            .and_then(|()| observers.metrics.begin(&simulation))
            .map_err(of_rig)?;
        let mut made = Self {
            simulation,
            steps: Steps::default(),
            seen: Seen::default(),
            observers: Some(observers),
            outcome: None,
            parts,
        };
        made.look()?;
        Ok(made)
    }
    /// Makes a step under this command, or that of the scenario's controller.
    #[pyo3(signature = (command=None))]
    fn step(&mut self, command: Option<&Bound<'_, PyAny>>) -> PyResult<Frame> {
        let over = || refused("the run is over", "check `over` before a step");
        let Some(observers) = self.observers.as_mut().filter(|_| self.outcome.is_none()) else {
            return Err(over());
        };
        let command = match command {
            None => self.simulation.control(&self.seen),
            Some(said) => {
                let base = self.seen.reference.command();
                Command::from_python(said, &base, self.simulation.vehicle.drives)?
            }
        };
        let (mut watch, mut last) = (self.parts.fault.clone(), Last::default());
        let mut all: [&mut dyn Observer; 4] = [
            &mut watch,
            &mut last,
            &mut observers.recorder,
            &mut observers.metrics,
        ];
        let made = self
            .steps
            .make(&mut self.simulation, command, &self.seen, &mut all);
        self.parts.fault.or(made)?;
        self.look()?;
        last.0.ok_or_else(|| defect("the step was not observed"))
    }
    /// The result of the run, once it is over.
    fn result(&mut self) -> PyResult<NativeRun> {
        let Some(outcome) = self.outcome.clone() else {
            return Err(refused("the run is not over", "make steps until `over`"));
        };
        let Some(mut observers) = self.observers.take() else {
            return Err(refused("the result can be read only once", "keep it"));
        };
        let finished = observers.recorder.finish();
        finished
            .and_then(|()| observers.metrics.finish())
            .map_err(of_rig)?;
        observers
            .left(&self.simulation, &outcome, None)
            .map_err(of_rig)
    }
}
