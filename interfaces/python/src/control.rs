//! Input of a controller, and a controller written in Python.

use crate::errors::Fault;
use crate::foreign::{instance, made};
use crate::signals::{Command, Estimate};
use crate::vehicle::Vehicle;
use monorig_estimators::api::signals;
use monorig_sim::closed_loop::registry::{BoxedController, Refusal};
use monorig_sim::control;
use pyo3::intern;
use pyo3::prelude::*;

/// The task of the controller in a step.
#[pyclass(frozen, module = "monorig", get_all, skip_from_py_object)]
#[derive(Clone)]
pub(crate) struct Reference {
    speed_mps: f64,
    accel_mps2: f64,
    emergency_brake: f64,
    clamp_pressure_mpa: f64,
}

impl From<&control::Reference> for Reference {
    fn from(r: &control::Reference) -> Self {
        Self {
            speed_mps: r.speed_mps,
            accel_mps2: r.accel_mps2,
            emergency_brake: r.emergency_brake,
            clamp_pressure_mpa: r.clamp_pressure_mpa,
        }
    }
}

#[pymethods]
impl Reference {
    fn __repr__(&self) -> String {
        format!(
            "Reference(speed_mps={}, accel_mps2={})",
            self.speed_mps, self.accel_mps2
        )
    }
}

/// The knowledge of the controller in a step.
#[pyclass(frozen, module = "monorig", get_all, skip_from_py_object)]
#[derive(Clone)]
pub(crate) struct Perception {
    speed_mps: f64,
    grade_rad: f64,
    total_mass_kg: f64,
    valid: bool,
    slip_mps: Vec<f64>,
    estimate: Option<Estimate>,
}

impl Perception {
    pub(crate) fn of(p: &control::Perception, drives: usize) -> Self {
        Self {
            speed_mps: p.speed_mps,
            grade_rad: p.grade_rad,
            total_mass_kg: p.total_mass_kg,
            valid: p.valid,
            slip_mps: p.slip_mps.iter().take(drives).copied().collect(),
            estimate: p.estimate.map(Estimate),
        }
    }
}

#[pymethods]
impl Perception {
    fn __repr__(&self) -> String {
        format!(
            "Perception(speed_mps={}, grade_rad={})",
            self.speed_mps, self.grade_rad
        )
    }
}

/// Data for which a controller is built, beside the vehicle.
#[pyclass(frozen, module = "monorig", get_all, skip_from_py_object)]
#[derive(Clone)]
pub(crate) struct ControllerSetup {
    motor_torque_max_nm: f64,
    gravity_mps2: f64,
    start_speed_mps: f64,
}

/// An object with a method `control`, called under the lock of the interpreter.
pub(crate) struct ForeignController {
    control: Py<PyAny>,
    drives: usize,
    fault: Fault,
}

impl ForeignController {
    /// Makes the controller for a vehicle. An exception is kept as the fault of the run.
    pub(crate) fn build(
        object: &Py<PyAny>,
        vehicle: &monorig_estimators::Vehicle,
        setup: &control::ControllerSetup,
        fault: &Fault,
    ) -> Result<BoxedController, Refusal> {
        let built = made(fault, |py| {
            let setup = ControllerSetup {
                motor_torque_max_nm: setup.motor_torque_max_nm,
                gravity_mps2: setup.gravity_mps2,
                start_speed_mps: setup.start_speed_mps,
            };
            let arguments = (Vehicle(*vehicle), setup);
            let object = instance(object.bind(py), "control", arguments)?;
            Ok(Self {
                control: object.getattr(intern!(py, "control"))?.unbind(),
                drives: vehicle.drives,
                fault: fault.clone(),
            })
        });
        Ok(Box::new(built?))
    }
}

impl control::Controller for ForeignController {
    fn control(
        &mut self,
        reference: &control::Reference,
        perception: &control::Perception,
        dt_s: f64,
    ) -> signals::Command {
        let base = reference.command();
        let call = |py: Python<'_>| {
            let seen = Perception::of(perception, self.drives);
            let said = self
                .control
                .bind(py)
                .call1((Reference::from(reference), seen, dt_s))?;
            Command::from_python(&said, &base, self.drives)
        };
        // an exception ends the run after this step: its command has no effect that anybody sees
        Python::attach(call).unwrap_or_else(|e| {
            self.fault.keep(e);
            base
        })
    }
}
