//! A table of Arrow, as Python gets it: every library of Arrow takes it without a copy.

use crate::errors::{defect, refused};
use crate::parts::detached;
use arrow_array::cast::AsArray;
use arrow_array::types::{Float64Type, Int64Type};
use arrow_array::{Array, ArrayRef, RecordBatch};
use arrow_schema::DataType;
use arrow_select::concat::concat_batches;
use monorig_sim::config::file::{input_error, nearest};
use monorig_sim::error::Error;
use monorig_sim::guarded::decoded;
use numpy::IntoPyArray;
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use pyo3_arrow::PyRecordBatch;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Columns of equal length with names and units.
#[pyclass(frozen, module = "monorig")]
pub(crate) struct Table(pub(crate) RecordBatch);

#[pymethods]
impl Table {
    #[getter]
    fn names(&self) -> Vec<String> {
        let schema = self.0.schema();
        schema.fields().iter().map(|f| f.name().clone()).collect()
    }
    #[getter]
    fn units<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let units = PyDict::new(py);
        for field in self.0.schema().fields() {
            if let Some(unit) = field.metadata().get("unit") {
                units.set_item(field.name(), unit)?;
            }
        }
        Ok(units)
    }
    #[getter]
    fn num_rows(&self) -> usize {
        self.0.num_rows()
    }
    fn __len__(&self) -> usize {
        self.0.num_rows()
    }
    fn __contains__(&self, name: &str) -> bool {
        self.0.column_by_name(name).is_some()
    }
    /// A column as an array of numpy; NaN where a row has no value.
    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let Some(array) = self.0.column_by_name(name) else {
            let schema = self.0.schema();
            let names = schema.fields().iter().map(|f| f.name().as_str());
            let help = match nearest(name, names) {
                Some(near) => format!("did you mean `{near}`?"),
                None => "use a name in `names`".to_owned(),
            };
            return Err(refused(format!("the table has no channel `{name}`"), help));
        };
        Ok(match array.data_type() {
            DataType::Boolean => flags(array).into_pyarray(py).into_any(),
            DataType::Int64 if array.null_count() == 0 => {
                let values = array.as_primitive::<Int64Type>().values();
                values.to_vec().into_pyarray(py).into_any()
            }
            DataType::Int64 => {
                let values = array.as_primitive::<Int64Type>().iter();
                let values: Vec<f64> = values.map(|x| x.map_or(f64::NAN, |x| x as f64)).collect();
                values.into_pyarray(py).into_any()
            }
            _ => {
                let values = array.as_primitive::<Float64Type>().iter();
                let values: Vec<f64> = values.map(|x| x.unwrap_or(f64::NAN)).collect();
                values.into_pyarray(py).into_any()
            }
        })
    }
    /// The Arrow PyCapsule interface.
    #[pyo3(signature = (requested_schema=None))]
    fn __arrow_c_array__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let batch = Bound::new(py, PyRecordBatch::new(self.0.clone()))?;
        batch.call_method1("__arrow_c_array__", (requested_schema,))
    }
    /// Writes the table to a Parquet file.
    fn to_parquet(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let file = File::create(&path)?;
        let write = || {
            let mut writer = ArrowWriter::try_new(file, self.0.schema(), None)?;
            writer.write(&self.0)?;
            writer.close()
        };
        py.detach(write).map(drop).map_err(defect)
    }
    /// The table in a Parquet file.
    #[staticmethod]
    fn from_parquet(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        detached(py, || read(&path)).map(Self)
    }
    fn __repr__(&self) -> String {
        let (rows, columns) = (self.0.num_rows(), self.0.num_columns());
        format!("<Table of {rows} rows and {columns} columns>")
    }
}

fn flags(array: &ArrayRef) -> Vec<bool> {
    let values = array.as_boolean().iter();
    values.map(|x| x.unwrap_or(false)).collect()
}

/// The whole table in a Parquet file.
pub(crate) fn read(path: &Path) -> Result<RecordBatch, Error> {
    let all = || {
        let builder = ParquetRecordBatchReaderBuilder::try_new(File::open(path)?)?;
        let schema = builder.schema().clone();
        let batches = builder.build()?.collect::<Result<Vec<_>, _>>()?;
        Ok::<_, Box<dyn std::error::Error>>(concat_batches(&schema, &batches)?)
    };
    let help = "a Parquet file that monorig has written";
    let broken = |what: String| input_error(path, "", what, help);
    let read = decoded(|| all().map_err(|e| broken(e.to_string())));
    read.unwrap_or_else(|what| Err(broken(what.to_owned())))
}
