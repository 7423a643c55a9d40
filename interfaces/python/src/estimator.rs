//! One of ours: step by step, over arrays, over kept samples.

use crate::errors::{defect, refused};
use crate::signals::{Estimate, Measurements};
use crate::table::Table;
use crate::vehicle::Vehicle;
use arrow_array::{ArrayRef, BooleanArray, Float64Array, Int64Array, RecordBatch};
use arrow_schema::{DataType, Field, Schema};
use arrow_select::concat::concat_batches;
use monorig_estimators::api::params::{Key, KeyKind, Setting};
use monorig_estimators::api::signals::{self, Measurand, Sample, Shape, Slot};
use monorig_estimators::api::snapshot::MAX_SNAPSHOT_BYTES;
use monorig_estimators::registry::{self, AnyEstimator};
use monorig_estimators::{Error, Estimator as _, Time};
use monorig_logs::export::SampleColumns;
use monorig_sim::closed_loop::registry::Registry;
use numpy::{Element, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyBytes, PyDict};
use pyo3_arrow::input::AnyRecordBatch;
use std::collections::HashMap;
use std::ffi::CString;
use std::sync::Arc;

/// Python is asked for Ctrl-C once in so many steps.
const STEPS_PER_QUESTION: usize = 65_536;

/// Names of all estimators, those as printed too.
#[pyfunction]
pub(crate) fn names() -> Vec<&'static str> {
    registry::NAMES
        .iter()
        .chain(registry::PRINTED_NAMES)
        .copied()
        .collect()
}

/// Name, description, unit, default and range or choices of each parameter.
#[pyfunction]
pub(crate) fn parameters(py: Python<'_>, name: &str) -> PyResult<Vec<Py<PyDict>>> {
    let registry = Registry::default();
    let of_type = registry
        .find_estimator(name)
        .map_err(crate::errors::of_refusal)?;
    let one = |key: &'static Key| {
        let d = PyDict::new(py);
        d.set_item("name", key.name)?;
        d.set_item("doc", key.doc)?;
        match key.kind {
            KeyKind::Number {
                unit,
                default,
                range,
            } => {
                d.set_item("unit", unit)?;
                d.set_item("default", default)?;
                d.set_item("range", (range[0], range[1]))?;
            }
            KeyKind::Flag { default } => d.set_item("default", default)?,
            KeyKind::Choice { default, choices } => {
                d.set_item("default", default)?;
                d.set_item("choices", choices.to_vec())?;
            }
        }
        Ok(d.unbind())
    };
    of_type.keys().map(one).collect()
}

/// A value of a parameter, kept while the estimator is built.
enum Given {
    Number(f64),
    Flag(bool),
    Word(String),
}

impl Given {
    fn of(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Ok(flag) = value.cast::<PyBool>() {
            Ok(Self::Flag(flag.is_true()))
        } else if let Ok(word) = value.extract() {
            Ok(Self::Word(word))
        } else if let Ok(number) = value.extract() {
            Ok(Self::Number(number))
        } else {
            let told = format!(
                "{} cannot be the value of a parameter",
                crate::signals::kind(value)
            );
            Err(refused(told, "use a number, True or False, or a word"))
        }
    }

    fn setting(&self) -> Setting<'_> {
        match self {
            Self::Number(x) => Setting::Number(*x),
            Self::Flag(flag) => Setting::Flag(*flag),
            Self::Word(word) => Setting::Choice(word),
        }
    }
}

/// One of our estimators, by its name.
#[pyclass(module = "monorig")]
pub(crate) struct Estimator {
    estimator: AnyEstimator,
    #[pyo3(get)]
    vehicle: Vehicle,
    #[pyo3(get)]
    parameters: Py<PyDict>,
}

/// The quantities of an estimate: name, unit.
const QUANTITIES: [(&str, &str); 4] = [
    ("total_mass", "kg"),
    ("grade", "rad"),
    ("effective_grade", "rad"),
    ("speed", "m/s"),
];

/// The columns of the estimates, row by row.
#[derive(Default)]
struct Estimates {
    t_ns: Vec<i64>,
    values: [Vec<f64>; 4],
    sd: [Vec<f64>; 4],
    valid: [Vec<bool>; 4],
    levels: [Vec<f64>; 3],
    /// Rows whose step was refused, and why the first was.
    refused: Vec<usize>,
    reason: Option<Error>,
}

impl Estimates {
    fn of_rows(rows: usize) -> Self {
        let mut all = Self::default();
        all.t_ns.reserve(rows);
        for i in 0..4 {
            all.values[i].reserve(rows);
            all.sd[i].reserve(rows);
            all.valid[i].reserve(rows);
        }
        all
    }

    /// Appends a step; a refused one has no values.
    fn push(&mut self, t_ns: i64, step: Result<signals::Estimate, Error>) {
        let estimate = match step {
            Ok(e) => e,
            Err(e) => {
                self.reason.get_or_insert(e);
                self.refused.push(self.t_ns.len());
                signals::Estimate::default()
            }
        };
        self.t_ns.push(t_ns);
        let of = [
            estimate.total_mass_kg,
            estimate.grade_rad,
            estimate.effective_grade_rad,
            estimate.speed_mps,
        ];
        let p = &estimate.protection;
        let levels = [p.total_mass_kg, p.grade_rad, p.effective_grade_rad];
        for (column, level) in self.levels.iter_mut().zip(levels) {
            column.push(level);
        }
        for (i, v) in of.into_iter().enumerate() {
            self.values[i].push(v.value);
            self.sd[i].push(v.sd);
            self.valid[i].push(v.valid);
        }
    }

    /// The refusals in words, if there are any.
    fn warning(&self) -> Option<String> {
        let (first, reason) = (self.refused.first()?, self.reason?);
        let (count, all) = (self.refused.len(), self.t_ns.len());
        Some(format!(
            "{count} of {all} steps were refused, the first in row {first}: {reason}"
        ))
    }

    fn batch(self) -> PyResult<RecordBatch> {
        let nulls = (!self.refused.is_empty()).then(|| {
            let mut there = vec![true; self.t_ns.len()];
            for row in &self.refused {
                there[*row] = false;
            }
            arrow_buffer::NullBuffer::from(there)
        });
        let mut fields = vec![Field::new("t_ns", DataType::Int64, false)];
        let mut arrays: Vec<ArrayRef> = vec![Arc::new(Int64Array::from(self.t_ns))];
        let number = |x: Vec<f64>| Arc::new(Float64Array::new(x.into(), nulls.clone())) as ArrayRef;
        let quantities = QUANTITIES
            .into_iter()
            .zip(self.values)
            .zip(self.sd.into_iter().zip(self.valid));
        for (((name, unit), values), (sd, valid)) in quantities {
            let unit = HashMap::from([("unit".to_owned(), unit.to_owned())]);
            for (name, x) in [(name.to_owned(), values), (format!("{name}_sd"), sd)] {
                fields.push(Field::new(name, DataType::Float64, true).with_metadata(unit.clone()));
                arrays.push(number(x));
            }
            fields.push(Field::new(
                format!("{name}_valid"),
                DataType::Boolean,
                false,
            ));
            arrays.push(Arc::new(BooleanArray::from(valid)));
        }
        for ((name, unit), x) in QUANTITIES.into_iter().zip(self.levels) {
            let unit = HashMap::from([("unit".to_owned(), unit.to_owned())]);
            let field = Field::new(format!("{name}_protection"), DataType::Float64, true);
            fields.push(field.with_metadata(unit));
            arrays.push(number(x));
        }
        RecordBatch::try_new(Arc::new(Schema::new(fields)), arrays).map_err(defect)
    }

    fn told(self, py: Python<'_>) -> PyResult<Table> {
        if let Some(warning) = self.warning() {
            let category = py.get_type::<PyUserWarning>();
            PyErr::warn(py, &category, &CString::new(warning).map_err(defect)?, 1)?;
        }
        Ok(Table(self.batch()?))
    }
}

/// One measured quantity over all rows.
struct Input<'a> {
    slots: Vec<Slot>,
    /// Values of a row.
    width: usize,
    /// Values of a sample.
    per_sample: usize,
    values: &'a [f64],
}

impl<'a> Input<'a> {
    /// Checks the shape of an array: rows, and what the measurand has in each.
    fn new(
        name: &str,
        array: &'a PyReadonlyArrayDyn<'_, f64>,
        rows: usize,
        drives: usize,
    ) -> PyResult<Self> {
        let measurand = Measurand::named(name).ok_or_else(|| defect(name))?;
        let per_sample = measurand.shape().values();
        let columns = array.shape().get(1).copied();
        let samples = match measurand.shape() {
            Shape::PerDrive => drives,
            Shape::Auxiliary => columns.unwrap_or(1).clamp(1, measurand.shape().slots()),
            Shape::Vector | Shape::Scalar => 1,
        };
        let width = samples * per_sample;
        let fits = array.shape() == [rows, width] || (width == 1 && array.shape() == [rows]);
        if !fits {
            let wanted = match width {
                1 => format!("({rows},)"),
                _ => format!("({rows}, {width})"),
            };
            return Err(refused(
                format!("{name} has the shape {:?}", array.shape()),
                format!("{wanted}, NaN without a new sample"),
            ));
        }
        Ok(Self {
            slots: measurand.slots().take(samples).collect(),
            width,
            per_sample,
            values: array.as_slice().map_err(defect)?,
        })
    }

    /// Puts the samples of a row, if there are any.
    fn put(&self, row: usize, t: Time, z: &mut signals::Measurements) {
        let Some(values) = self.values.get(row * self.width..(row + 1) * self.width) else {
            return;
        };
        for (slot, of_sample) in self.slots.iter().zip(values.chunks_exact(self.per_sample)) {
            let mut value = [0.0; 3];
            for (to, from) in value.iter_mut().zip(of_sample) {
                *to = *from;
            }
            if !value.iter().any(|x| x.is_nan()) {
                slot.set(z, Some(Sample { t, value }));
            }
        }
    }
}

/// An array of Python in one piece as `T`, made of whatever holds such numbers.
fn numbers<'py, T: Element>(
    name: &str,
    value: &Bound<'py, PyAny>,
) -> PyResult<PyReadonlyArrayDyn<'py, T>> {
    let types = value.py().import("monorig._types")?;
    let kind = T::get_dtype(value.py());
    let array = types.call_method1("numbers", (name, value, kind))?;
    array
        .cast::<PyArrayDyn<T>>()?
        .try_readonly()
        .map_err(defect)
}

#[pymethods]
impl Estimator {
    #[new]
    #[pyo3(signature = (name, vehicle, **params))]
    fn new(
        py: Python<'_>,
        name: &str,
        vehicle: &Vehicle,
        params: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let registry = Registry::default();
        let of_type = registry
            .find_estimator(name)
            .map_err(crate::errors::of_refusal)?;
        let mut given: Vec<(String, Given)> = Vec::new();
        for (key, value) in params.into_iter().flatten() {
            given.push((key.extract()?, Given::of(&value)?));
        }
        let settings = || {
            given
                .iter()
                .map(|(key, value)| (key.as_str(), value.setting()))
        };
        for (key, value) in settings() {
            of_type
                .check(key, value)
                .map_err(crate::errors::of_refusal)?;
        }
        let built = registry::build(name, &vehicle.0, settings());
        let parameters = params.map_or_else(|| Ok(PyDict::new(py)), |p| p.copy());
        Ok(Self {
            estimator: built.map_err(|e| refused(e, "use values that fit this vehicle"))?,
            vehicle: vehicle.clone(),
            parameters: parameters?.unbind(),
        })
    }

    #[getter]
    fn name(&self) -> &'static str {
        self.estimator.name()
    }

    /// Resets the estimator to its first state.
    fn reset(&mut self) {
        self.estimator.reset();
    }

    /// Its state, as bytes.
    fn snapshot<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let mut bytes = vec![0; MAX_SNAPSHOT_BYTES];
        let used = self.estimator.snapshot(&mut bytes);
        let used = used.map_err(|e| refused(e, "use an estimator that can make snapshots"))?;
        bytes.truncate(used);
        Ok(PyBytes::new(py, &bytes))
    }

    /// The state of a snapshot.
    fn restore(&mut self, snapshot: &[u8]) -> PyResult<()> {
        let help = "use a complete snapshot of the same estimator, vehicle and parameters";
        self.estimator
            .restore(snapshot)
            .map_err(|e| refused(e, help))
    }

    /// Its internal quantities now, by name.
    fn internal_values<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let names = self.estimator.internals();
        let mut values = vec![f64::NAN; names.len()];
        self.estimator.internal_values(&mut values);
        let all = PyDict::new(py);
        for (internal, value) in names.iter().zip(values) {
            all.set_item(internal.name, value)?;
        }
        Ok(all)
    }

    /// One step of `dt` seconds.
    fn step(&mut self, z: &Measurements, dt: f64) -> PyResult<Estimate> {
        let help = "use a step that follows the previous step; the estimator is unchanged";
        let step = self.estimator.step(&z.z, &z.u, dt);
        step.map(Estimate).map_err(|e| refused(e, help))
    }

    /// All steps at once.
    #[pyo3(signature = (t_ns, *, dt_s=None, **inputs))]
    fn run(
        &mut self,
        py: Python<'_>,
        t_ns: &Bound<'_, PyAny>,
        dt_s: Option<f64>,
        inputs: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Table> {
        let t_ns = numbers::<i64>("t_ns", t_ns)?;
        let t = t_ns.as_slice().map_err(defect)?;
        let mut arrays = Vec::new();
        for (name, value) in inputs.into_iter().flatten() {
            let name: String = name.extract()?;
            if Measurand::named(&name).is_none() {
                let names: Vec<&str> = Measurand::ALL.iter().map(|m| m.name()).collect();
                return Err(refused(
                    format!("no measurement is called `{name}`"),
                    names.join(", "),
                ));
            }
            if !value.is_none() {
                arrays.push((name.clone(), numbers::<f64>(&name, &value)?));
            }
        }
        let inputs = arrays
            .iter()
            .map(|(name, array)| Input::new(name, array, t.len(), self.vehicle.0.drives));
        let inputs = inputs.collect::<PyResult<Vec<Input<'_>>>>()?;
        // the first step is as long as the second, unless it is said
        let first_s = match (dt_s, t) {
            (Some(dt_s), _) => dt_s,
            (None, [a, b, ..]) => Time::from_ns(*b).since(Time::from_ns(*a)),
            (None, _) => 0.005,
        };
        let estimator = &mut self.estimator;
        let made = py.detach(|| {
            let mut all = Estimates::of_rows(t.len());
            let mut last: Option<Time> = None;
            for (row, &ns) in t.iter().enumerate() {
                let now = Time::from_ns(ns);
                let mut z = signals::Measurements::at(now);
                inputs.iter().for_each(|input| input.put(row, now, &mut z));
                let dt = last.map_or(first_s, |last| now.since(last));
                last = Some(now);
                all.push(ns, estimator.step(&z, &signals::Command::default(), dt));
                if (row + 1).is_multiple_of(STEPS_PER_QUESTION) {
                    Python::attach(|py| py.check_signals())?;
                }
            }
            Ok::<_, PyErr>(all)
        })?;
        made.told(py)
    }

    /// All steps of kept samples.
    fn run_samples(&mut self, py: Python<'_>, table: AnyRecordBatch) -> PyResult<Table> {
        let (batches, schema) = table.into_table()?.into_inner();
        let batch = concat_batches(&schema, &batches).map_err(defect)?;
        let columns = SampleColumns::new(&batch, self.vehicle.0.drives);
        let help = "use the columns of `samples.parquet` of this vehicle";
        let columns = columns.map_err(|e| refused(e, help))?;
        let estimator = &mut self.estimator;
        let made = py.detach(|| {
            let mut all = Estimates::of_rows(batch.num_rows());
            let (mut command, mut last_s) = (signals::Command::default(), 0.0);
            for row in 0..batch.num_rows() {
                let step = columns.step(row);
                command = step.command.unwrap_or(command);
                // as the loop does: a command that changes without a sample is no step
                if !step.z.any() {
                    continue;
                }
                let now_s = step.arrival_ns as f64 * 1e-9;
                all.push(
                    step.arrival_ns,
                    estimator.step(&step.z, &command, now_s - last_s),
                );
                last_s = now_s;
                if (row + 1).is_multiple_of(STEPS_PER_QUESTION) {
                    Python::attach(|py| py.check_signals())?;
                }
            }
            Ok::<_, PyErr>(all)
        })?;
        made.told(py)
    }

    fn __repr__(&self) -> String {
        format!(
            "Estimator({:?}, {} drives)",
            self.estimator.name(),
            self.vehicle.0.drives
        )
    }
}
