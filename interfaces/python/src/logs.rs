//! Recorded logs: what is in one, and what is found of its vehicle and instruments.

use crate::errors::{defect, refused};
use crate::parts::{Parts, detached};
use monorig_logs::check::{identify, inspect as look, proposed_map, with_axes};
use monorig_logs::identify::{apply, write};
use monorig_logs::map::Map;
use monorig_logs::read::ReadOptions;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::json;
use std::path::PathBuf;

/// The tables of a log and a map proposed for it, as JSON.
#[pyfunction]
pub(crate) fn inspect(
    py: Python<'_>,
    log: PathBuf,
    time: Option<String>,
    unit: Option<String>,
    dbc: Option<PathBuf>,
) -> PyResult<String> {
    let known = unit.map(|unit| {
        serde_json::from_value(unit.clone().into())
            .map_err(|_| refused(format!("unit={unit}"), "s, ms, us, ns or iso8601"))
    });
    let options = ReadOptions {
        time,
        unit: known.transpose()?,
        dbc,
        ..ReadOptions::default()
    };
    detached(py, || {
        let found = look(&log, &options)?;
        let file = log.file_name().unwrap_or_default().to_string_lossy();
        let map = proposed_map(&[("log".to_owned(), file.into_owned(), &found)]);
        Ok(json!({"found": found, "map": with_axes(map, &log)}).to_string())
    })
}

/// The parameters that a log shows, and the keys of its map that they change, as JSON.
#[pyfunction]
#[pyo3(signature = (map, log, with_mass, set, put))]
pub(crate) fn calibrate(
    py: Python<'_>,
    map: PathBuf,
    log: Option<PathBuf>,
    with_mass: bool,
    set: Option<&Bound<'_, PyDict>>,
    put: bool,
) -> PyResult<String> {
    let mut sets = Parts::new(map.clone(), set, None, None, None)?.changes_of_map();
    if !with_mass {
        sets.push(("reference.mass".into(), "null".into()));
    }
    let found = detached(py, || {
        let map = Map::load_with(&map, log.as_deref(), &sets)?;
        for (key, is_there) in [
            ("mass", map.has_mass() || !with_mass),
            ("slope", map.has_slope()),
        ] {
            if !is_there {
                let key = format!("reference.{key}");
                let why = "the map does not give what is said to be known of the drive";
                return Err(map.error(key, why, "this key in the map, or known=[\"slope\"]"));
            }
        }
        let (parameters, lacks) = identify(&map)?;
        let applied = apply(&map, &parameters);
        if put {
            write(&map, &applied, &map.log_names())?;
        }
        Ok(json!({"parameters": parameters, "changes": applied, "not_found": lacks}))
    })?;
    serde_json::to_string(&found).map_err(defect)
}
