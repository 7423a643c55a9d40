//! An estimator written in Python, as an estimator of the loop.

use crate::errors::{Fault, refused};
use crate::signals::{Estimate, Measurements, kind};
use crate::vehicle::Vehicle;
use monorig_estimators::api::signals;
use monorig_estimators::{Error, Estimator, Internal, Real, Value};
use monorig_sim::closed_loop::interned;
use monorig_sim::closed_loop::registry::{BoxedEstimator, Refusal};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};

/// The values that a step may return.
const RETURNS: &str = "an Estimate, (total_mass_kg, grade_rad), or None to refuse the step";

/// An object with a method `step`, called under the lock of the interpreter.
pub(crate) struct Foreign {
    object: Py<PyAny>,
    /// Its method, looked up once.
    step: Py<PyAny>,
    internals: Vec<Internal>,
    drives: usize,
    fault: Fault,
}

/// The object itself, or what a class or another callable makes of the arguments. An object is one that has `method`.
pub(crate) fn instance<'py, A>(
    object: &Bound<'py, PyAny>,
    method: &str,
    arguments: A,
) -> PyResult<Bound<'py, PyAny>>
where
    A: pyo3::call::PyCallArgs<'py>,
{
    let is_class = object.is_instance_of::<PyType>();
    let made = match is_class || (object.is_callable() && !object.hasattr(method)?) {
        true => object.call1(arguments)?,
        false => object.clone(),
    };
    match made.hasattr(method)? {
        true => Ok(made),
        false => Err(refused(
            format!("{} has no method `{method}`", kind(&made)),
            format!(
                "use an object with `{method}`, a class of such objects, or a function that makes an object"
            ),
        )),
    }
}

/// A part that Python makes. An exception is kept as the fault of the run.
pub(crate) fn made<T>(
    fault: &Fault,
    make: impl FnOnce(Python<'_>) -> PyResult<T>,
) -> Result<T, Refusal> {
    Python::attach(make).map_err(|e| {
        let told = e.to_string();
        fault.keep(e);
        Refusal::new(told, "see the exception")
    })
}

impl Foreign {
    /// Makes the estimator for a vehicle. An exception is kept as the fault of the run.
    pub(crate) fn build(
        object: &Py<PyAny>,
        vehicle: &monorig_estimators::Vehicle,
        fault: &Fault,
    ) -> Result<BoxedEstimator, Refusal> {
        let built = made(fault, |py| {
            let object = instance(object.bind(py), "step", (Vehicle(*vehicle),))?;
            Ok(Self {
                step: object.getattr(intern!(py, "step"))?.unbind(),
                internals: internals(&object)?,
                object: object.unbind(),
                drives: vehicle.drives,
                fault: fault.clone(),
            })
        });
        Ok(Box::new(built?))
    }

    /// None if the step is refused without a reason.
    fn call(
        &self,
        z: &signals::Measurements,
        u: &signals::Command,
        dt: Real,
    ) -> PyResult<Option<signals::Estimate>> {
        Python::attach(|py| {
            let seen = Measurements {
                z: *z,
                u: *u,
                drives: self.drives,
            };
            let said = self.step.bind(py).call1((seen, dt))?;
            if said.is_none() {
                return Ok(None);
            }
            if let Ok(estimate) = said.cast::<Estimate>() {
                let t = z.t;
                return Ok(Some(signals::Estimate {
                    t,
                    ..estimate.get().0
                }));
            }
            let Ok((mass, grade)) = said.extract::<(f64, f64)>() else {
                let told = format!(
                    "step of {} returned {}; a step returns {RETURNS}",
                    kind(self.object.bind(py)),
                    kind(&said)
                );
                return Err(pyo3::exceptions::PyTypeError::new_err(told));
            };
            let known = |value| Value {
                value,
                sd: 0.0,
                valid: true,
            };
            Ok(Some(signals::Estimate {
                total_mass_kg: known(mass),
                grade_rad: known(grade),
                effective_grade_rad: known(grade),
                ..signals::Estimate::at(z.t)
            }))
        })
    }
}

/// The internal quantities that an object names: `internals = {"bias": "m/s²"}`.
fn internals(object: &Bound<'_, PyAny>) -> PyResult<Vec<Internal>> {
    let Ok(named) = object.getattr("internals") else {
        return Ok(Vec::new());
    };
    let help = "a dict of names and units, such as {\"bias\": \"m/s²\"}";
    let named = named
        .cast_into::<PyDict>()
        .map_err(|_| refused("`internals` is not a dict", help))?;
    let one = |(name, unit): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let (name, unit): (String, String) = (name.extract()?, unit.extract()?);
        Ok(Internal::new(interned(&name), interned(&unit)))
    };
    let all: PyResult<Vec<Internal>> = named.iter().map(one).collect();
    let all = all.map_err(|_: PyErr| refused("`internals` has a value that is not text", help))?;
    if !all.is_empty() && !object.hasattr("internal_values")? {
        return Err(refused(
            "the object has `internals`, but no method `internal_values`",
            "add a method that returns their values, in the order of their names",
        ));
    }
    Ok(all)
}

/// The estimate, if it can be one.
fn checked(estimate: signals::Estimate) -> Result<signals::Estimate, Error> {
    let of = [
        ("total_mass", estimate.total_mass_kg),
        ("grade", estimate.grade_rad),
        ("effective_grade", estimate.effective_grade_rad),
        ("speed", estimate.speed_mps),
    ];
    for (name, v) in of {
        if !v.value.is_finite() {
            return Err(Error::own(format_args!(
                "the value of {name} is {}",
                v.value
            )));
        }
        if !(v.sd >= 0.0 && v.sd.is_finite()) {
            return Err(Error::own(format_args!(
                "the standard deviation of {name} is {}",
                v.sd
            )));
        }
    }
    match estimate.is_finite() {
        true => Ok(estimate),
        false => Err(Error::own("innovation or nis is not finite")),
    }
}

impl Estimator for Foreign {
    fn step(
        &mut self,
        z: &signals::Measurements,
        u: &signals::Command,
        dt: Real,
    ) -> Result<signals::Estimate, Error> {
        match self.call(z, u, dt) {
            Ok(Some(estimate)) => checked(estimate),
            Ok(None) => Err(Error::own("step returned None")),
            Err(e) => {
                let broken = Error::broken(&e);
                self.fault.keep(e);
                Err(broken)
            }
        }
    }

    fn reset(&mut self) {
        let reset = |py: Python<'_>| {
            let object = self.object.bind(py);
            match object.hasattr(intern!(py, "reset"))? {
                true => object.call_method0(intern!(py, "reset")).map(drop),
                false => Ok(()),
            }
        };
        if let Err(e) = Python::attach(reset) {
            self.fault.keep(e);
        }
    }

    fn internals(&self) -> &[Internal] {
        &self.internals
    }

    fn internal_values(&self, values: &mut [Real]) {
        if self.internals.is_empty() {
            return;
        }
        let get = |py: Python<'_>| -> PyResult<Vec<f64>> {
            let said = self
                .object
                .bind(py)
                .call_method0(intern!(py, "internal_values"))?;
            let said: Vec<f64> = said.extract()?;
            match said.len() == self.internals.len() {
                true => Ok(said),
                false => Err(refused(
                    format!("internal_values has {} values", said.len()),
                    format!(
                        "return one value for each of the {} internals",
                        self.internals.len()
                    ),
                )),
            }
        };
        match Python::attach(get) {
            Ok(said) => values.iter_mut().zip(said).for_each(|(to, x)| *to = x),
            Err(e) => self.fault.keep(e),
        }
    }
}
