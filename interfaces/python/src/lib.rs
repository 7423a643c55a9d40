//! The native half of the Python package `monorig`. A user sees `interfaces/python/monorig/__init__.py`, which calls
//! the functions here.
//!
//! | file | what it holds |
//! |---|---|
//! | `class` | fields of a class that Python reads |
//! | `errors` | errors as exceptions; the exception that ends a run |
//! | `signals` | measurements, commands, estimates |
//! | `vehicle` | the nominal vehicle |
//! | `estimator` | one of ours, step by step and over arrays |
//! | `foreign` `control` | an estimator and a controller written in Python, in the loop |
//! | `parts` | what a user adds to a scenario: changes, estimators, a controller |
//! | `columns` | the channels of a run in memory |
//! | `table` | a table of Arrow, as Python gets it |
//! | `run` | a scenario or a log from begin to end |
//! | `single_steps` | a run that the user steps |
//! | `batch` | many runs: results, comparisons, verdicts |
//! | `series` | lists of runs that answer one question: stress, explain |
//! | `logs` | recorded logs: contents, calibration |
//! | `tuning` | studies of parameters, and their objective |

mod batch;
mod class;
mod columns;
mod control;
mod errors;
mod estimator;
mod foreign;
mod logs;
mod parts;
mod run;
mod series;
mod signals;
mod single_steps;
mod table;
mod tuning;
mod vehicle;

use pyo3::prelude::*;

#[pymodule]
fn _monorig(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_class::<signals::Command>()?;
    m.add_class::<signals::Estimate>()?;
    m.add_class::<signals::Measurements>()?;
    m.add_class::<vehicle::Vehicle>()?;
    m.add_class::<estimator::Estimator>()?;
    m.add_class::<control::ControllerSetup>()?;
    m.add_class::<control::Perception>()?;
    m.add_class::<control::Reference>()?;
    m.add_class::<run::NativeRun>()?;
    m.add_class::<single_steps::NativeSimulation>()?;
    m.add_class::<single_steps::Frame>()?;
    m.add_class::<table::Table>()?;
    m.add_class::<tuning::NativeObjective>()?;
    m.add_function(wrap_pyfunction!(estimator::names, m)?)?;
    m.add_function(wrap_pyfunction!(estimator::parameters, m)?)?;
    m.add_function(wrap_pyfunction!(run::run, m)?)?;
    m.add_function(wrap_pyfunction!(run::replay, m)?)?;
    m.add_function(wrap_pyfunction!(run::load, m)?)?;
    m.add_class::<series::NativeSeries>()?;
    m.add_function(wrap_pyfunction!(series::stress, m)?)?;
    m.add_function(wrap_pyfunction!(series::explain, m)?)?;
    m.add_function(wrap_pyfunction!(logs::inspect, m)?)?;
    m.add_function(wrap_pyfunction!(logs::calibrate, m)?)?;
    m.add_function(wrap_pyfunction!(batch::run_one, m)?)?;
    m.add_function(wrap_pyfunction!(batch::outline, m)?)?;
    m.add_function(wrap_pyfunction!(batch::compare, m)?)?;
    m.add_function(wrap_pyfunction!(batch::judge, m)?)?;
    m.add_function(wrap_pyfunction!(batch::metrics, m)?)?;
    m.add_function(wrap_pyfunction!(batch::kind, m)?)?;
    m.add_function(wrap_pyfunction!(batch::colour_place, m)?)?;
    m.add_function(wrap_pyfunction!(tuning::tune, m)?)?;
    // with affinity and, on Linux, the quota of the cgroup
    let processors = std::thread::available_parallelism().map_or(1, |n| n.get());
    m.add("PROCESSORS", processors)?;
    m.add("__version__", env!("CARGO_PKG_VERSION"))
}
