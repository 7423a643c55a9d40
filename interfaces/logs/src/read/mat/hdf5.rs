//! MAT files of version 7.3, which are HDF5, by `hdf5-pure`: a struct is a group, a variable a dataset whose sizes
//! stand in the other order.

use super::workspace::Workspace;
use crate::read::full_name;
use arrow_array::{ArrayRef, Float64Array, Int64Array};
use hdf5_pure::{AttrValue, DType, Error, File, Group};
use std::sync::Arc;

/// Deepest group within groups.
const MAX_DEPTH: usize = 32;
/// Bytes that a group or a dataset counts as, so that a damaged file does not go round.
const VISIT: usize = 1 << 16;

/// Reads all variables. The error says what is wrong.
pub(super) fn read(bytes: Vec<u8>, found: &mut Workspace<'_>) -> Result<(), String> {
    let file = File::from_bytes(bytes).map_err(|e| e.to_string())?;
    group(&file.root(), "", 0, found)
}

fn group(at: &Group, path: &str, depth: usize, found: &mut Workspace<'_>) -> Result<(), String> {
    let broken = |name: &str, e: Error| format!("variable {}: {e}", full_name(path, name));
    for name in at.datasets().map_err(|e| broken("", e))? {
        found.take(VISIT)?;
        let data = at.dataset(&name).map_err(|e| broken(&name, e))?;
        let about = data.attrs().map_err(|e| broken(&name, e))?;
        let class = match about.get("MATLAB_class") {
            Some(AttrValue::AsciiString(class) | AttrValue::String(class)) => class.as_str(),
            _ => "",
        };
        if matches!(class, "char" | "cell" | "function_handle")
            || about.contains_key("MATLAB_empty")
        {
            found.leave(path, &name, class);
            continue;
        }
        if !found.needs(path, &name) {
            continue;
        }
        let kind = data.dtype().map_err(|e| broken(&name, e))?;
        let mut dims = Vec::new();
        for n in data
            .shape()
            .map_err(|e| broken(&name, e))?
            .into_iter()
            .rev()
        {
            dims.push(usize::try_from(n).unwrap_or(usize::MAX));
        }
        let bytes = dims.iter().fold(8usize, |all, n| all.saturating_mul(*n));
        let values: ArrayRef = match kind {
            DType::F32 | DType::F64 => {
                found.take(bytes)?;
                Arc::new(Float64Array::from(
                    data.read_f64().map_err(|e| broken(&name, e))?,
                ))
            }
            DType::I8
            | DType::I16
            | DType::I32
            | DType::I64
            | DType::U8
            | DType::U16
            | DType::U32
            | DType::U64 => {
                found.take(bytes)?;
                Arc::new(Int64Array::from(
                    data.read_i64().map_err(|e| broken(&name, e))?,
                ))
            }
            other => {
                found.leave(path, &name, &format!("{class} of {other}"));
                continue;
            }
        };
        found.put(path, &name, dims, values);
    }
    // groups called `#refs#` and `#subsystem#` hold the parts of cells and objects
    for name in at.groups().map_err(|e| broken("", e))? {
        found.take(VISIT)?;
        if depth < MAX_DEPTH && !name.starts_with('#') {
            let inner = at.group(&name).map_err(|e| broken(&name, e))?;
            group(&inner, &full_name(path, &name), depth + 1, found)?;
        }
    }
    Ok(())
}
