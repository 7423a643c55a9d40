//! Errors as exceptions, and the exception of a user's own code that ends a run.

use monorig_sim::closed_loop::registry::Refusal;
use monorig_sim::closed_loop::run::{Observer, StepFrame};
use monorig_sim::error::Error;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::fmt::Display;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// An exception of the module `monorig._errors`, built with these arguments.
fn exception<'py, A>(py: Python<'py>, name: &str, arguments: A) -> PyErr
where
    A: pyo3::call::PyCallArgs<'py>,
{
    let class = py.import("monorig._errors").and_then(|m| m.getattr(name));
    match class.and_then(|class| class.call1(arguments)) {
        Ok(made) => PyErr::from_value(made),
        Err(e) => e,
    }
}

/// An `InputError`: what is wrong, and what would be right.
pub(crate) fn refused(message: impl Display, help: impl Display) -> PyErr {
    Python::attach(|py| {
        let arguments = (message.to_string(), help.to_string());
        exception(py, "InputError", arguments)
    })
}

/// A name or a value that the registry refuses.
pub(crate) fn of_refusal(w: Refusal) -> PyErr {
    refused(w.message, w.help)
}

/// An error of the rig as the exception that says the same.
pub(crate) fn of_rig(error: Error) -> PyErr {
    Python::attach(|py| match error {
        Error::Input(e) => {
            let file = e.file.display().to_string();
            let file = (!file.is_empty()).then_some(file);
            let key = (!e.key.is_empty()).then_some(e.key);
            exception(py, "InputError", (e.message, e.help, file, e.line, key))
        }
        Error::Io { path, source } => {
            let told = format!("{}: {source}", path.display());
            std::io::Error::new(source.kind(), told).into()
        }
        broken => exception(py, "RunError", (broken.to_string(),)),
    })
}

/// A defect of the module itself.
pub(crate) fn defect(e: impl Display) -> PyErr {
    PyRuntimeError::new_err(e.to_string())
}

/// The first exception of a user's own code in a run; it ends the run, and is raised where the run was started.
#[derive(Clone, Default)]
pub(crate) struct Fault(Arc<Raised>);

#[derive(Default)]
struct Raised {
    /// Set with the exception: asked every step.
    there: AtomicBool,
    exception: Mutex<Option<PyErr>>,
}

impl Fault {
    /// Keeps an exception, if it is the first.
    pub(crate) fn keep(&self, e: PyErr) {
        let mut exception = self
            .0
            .exception
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        exception.get_or_insert(e);
        self.0.there.store(true, Ordering::Release);
    }

    /// True if there is one.
    pub(crate) fn is_there(&self) -> bool {
        self.0.there.load(Ordering::Acquire)
    }

    /// The result of a run: the exception, if there is one.
    pub(crate) fn or<T>(&self, done: Result<T, Error>) -> PyResult<T> {
        let mut exception = self
            .0
            .exception
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        match exception.take() {
            Some(e) => Err(e),
            None => done.map_err(of_rig),
        }
    }

    /// Asks Python for signals such as Ctrl-C; false if one ends the run.
    pub(crate) fn go_on(&self) -> bool {
        if let Err(e) = Python::attach(|py| py.check_signals()) {
            self.keep(e);
        }
        !self.is_there()
    }
}

/// Ends the run at the step in which an exception was raised where no error can be returned.
impl Observer for Fault {
    fn on_step(&mut self, f: &StepFrame<'_>) -> Result<(), Error> {
        match self.is_there() {
            false => Ok(()),
            true => Err(Error::Broken {
                t_s: f.time_ns as f64 * 1e-9,
                what: "an exception in Python".into(),
            }),
        }
    }
}
