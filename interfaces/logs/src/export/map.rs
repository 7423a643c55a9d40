//! The map file of an export: replaying it gives the estimators of the run what they were given in the run.

use super::Samples;
use super::tables::{COMMAND, TRUTH, Table};
use super::writer::LogWriter;
use crate::io;
use monorig_estimators::api::signals::{Measurand, Shape};
use monorig_sim::error::Error;
use monorig_sim::record::manifest::{Manifest, sum};
use serde_json::{Map, Value, json};
use std::path::Path;

/// Name of the file with the vehicle.
const VEHICLE: &str = "vehicle.yaml";
/// Largest number of changes of the mass that count as steps of the load.
const MAX_MASS_STEPS: usize = 10_000;

/// Writes map and vehicle into the folder; the name of the map file.
pub(super) fn write(
    folder: &Path,
    name: &str,
    format: &dyn LogWriter,
    samples: &Samples,
    tables: &[Table],
    masses: &[(i64, f64)],
    manifest: &Manifest,
) -> Result<String, Error> {
    let put = |file: &str, value: &Value, title: &str| {
        let path = folder.join(file);
        let text = format!("# {title}\n{}", yaml(value));
        std::fs::write(&path, text).map_err(|e| io(&path, e))
    };
    // numbers and lists of them: nothing that cannot be JSON
    let vehicle = serde_json::to_value(&samples.vehicle_file).unwrap_or_default();
    let title = "The nominal vehicle of the run's estimators; written by `monorig log export`.";
    put(VEHICLE, &vehicle, title)?;
    let names = Names { format, tables };
    let mut map = json!({
        "version": 1,
        "why": format!("Run {} with seed {}, exported as {}", manifest.scenario, manifest.seed, format.name()),
        "files": names.files(name),
        "time": {"unit": "ns", "stamp": "stamp_ns", "order": "arrival", "origin": "zero", "segment_gap_s": 1e6},
        "step": {"rate_hz": 1e9 / samples.step_ns as f64, "many": "newest"},
        "vehicle": VEHICLE,
        "noise": "defaults",
        "channels": names.channels(),
        "reference": names.references(masses),
        "estimators": estimators(manifest),
    });
    format.adapt(&mut map, name);
    for key in ["availability", "integrity", "record"] {
        if let Some(value) = manifest.resolved.get(key) {
            map[key] = value.clone();
        }
    }
    let file = format!("{name}_{}.map.yaml", format.name());
    let title = "Replays a run: `monorig replay --map` this file; written by `monorig log export`.";
    put(&file, &map, title)?;
    Ok(file)
}

/// The estimators of the run with their parameters, those of parameter files among them.
fn estimators(manifest: &Manifest) -> Value {
    let mut all = manifest
        .resolved
        .get("estimators")
        .cloned()
        .unwrap_or_else(|| json!({}));
    for settings in all
        .as_object_mut()
        .into_iter()
        .flat_map(|all| all.values_mut())
    {
        if let Some(settings) = settings.as_object_mut() {
            settings.remove("from"); // its values are there, and its path is not
        }
    }
    all
}

/// Names libraries, FMUs and files of programs that are in the scenario's folder as they were in the run by their whole
/// path: the map is in another folder.
pub(super) fn name_whole_paths(manifest: &mut Manifest, folder: &Path) {
    let inputs = &manifest.inputs;
    let whole = |name: &mut Value| {
        let path = folder.join(name.as_str().unwrap_or_default());
        let there = sum(&path)
            .ok()
            .filter(|sum| inputs.values().any(|s| s == sum));
        if let (Some(_), Ok(path)) = (there, path.canonicalize()) {
            *name = path.to_string_lossy().into();
        }
    };
    let all = manifest.resolved["estimators"].as_object_mut();
    for settings in all.into_iter().flat_map(|all| all.values_mut()) {
        let files = ["/library", "/fmu"].into_iter();
        let words = (0..).map_while(|k| {
            settings
                .pointer(&format!("/external/process/{k}"))
                .map(|_| format!("/external/process/{k}"))
        });
        let places: Vec<String> = files.map(str::to_owned).chain(words).collect();
        for place in places {
            settings.pointer_mut(&place).into_iter().for_each(&whole);
        }
    }
}

/// JSON is YAML; a key of the first level a line, so that it can be read and changed.
fn yaml(value: &Value) -> String {
    let lines = value.as_object().into_iter().flatten();
    lines
        .map(|(key, value)| format!("{key}: {value}\n"))
        .collect()
}

/// The names of files and columns in a format.
struct Names<'a> {
    format: &'a dyn LogWriter,
    tables: &'a [Table],
}

impl Names<'_> {
    fn table(&self, index: usize) -> Option<&Table> {
        self.tables.get(index).filter(|t| !t.columns.is_empty())
    }

    fn files(&self, name: &str) -> Value {
        if let Some(only) = self.format.only_file(name) {
            return json!({ "run": only });
        }
        let mut files = Map::new();
        for table in self.tables.iter().filter(|t| !t.columns.is_empty()) {
            let file = format!("{}.{}", table.name, self.format.name());
            files.insert(table.name.into(), file.into());
        }
        Value::Object(files)
    }

    /// The name of a table's file under `files`.
    fn file(&self, table: &Table) -> &'static str {
        match self.format.only_file("") {
            None => table.name,
            Some(_) => "run",
        }
    }

    /// A column as the map file names it.
    fn column(&self, table: &Table, column: usize) -> String {
        self.format.column(table, column)
    }

    fn columns(&self, table: &Table) -> Vec<String> {
        (0..table.columns.len())
            .map(|c| self.column(table, c))
            .collect()
    }

    fn channels(&self) -> Value {
        let mut channels = Map::new();
        let unit = |t: &Table| t.units.first().copied().unwrap_or_default();
        for (index, measurand) in Measurand::ALL.iter().enumerate() {
            let Some(t) = self.table(index) else {
                continue;
            };
            let (file, unit, all) = (self.file(t), unit(t), self.columns(t));
            let each = || {
                let columns = all.iter();
                columns.map(|c| json!({"file": file, "column": c, "unit": unit}))
            };
            let (key, channel) = match (measurand, measurand.shape()) {
                (Measurand::MotorTorque, _) => (
                    "traction",
                    json!({"file": file, "torque": all, "unit": unit}),
                ),
                (Measurand::WheelSpeed, _) => (
                    measurand.name(),
                    json!([{"file": file, "columns": all, "unit": unit}]),
                ),
                (_, Shape::Vector) => (
                    measurand.name(),
                    json!({"file": file, "columns": all, "unit": unit}),
                ),
                (_, Shape::Scalar) => (measurand.name(), each().next().unwrap_or_default()),
                (_, Shape::PerDrive | Shape::Auxiliary) => (measurand.name(), each().collect()),
            };
            channels.insert(key.into(), channel);
        }
        if let Some(t) = self.table(COMMAND) {
            let mut torques = self.columns(t);
            let (brake, clamp) = (torques.pop(), torques.pop());
            let command = json!({"file": self.file(t), "torque": torques, "unit": unit(t), "clamp_pressure_mpa": clamp, "brake": brake});
            channels.insert("command".into(), command);
        }
        Value::Object(channels)
    }

    fn references(&self, masses: &[(i64, f64)]) -> Value {
        let mut references = Map::new();
        if let Some(t) = self.table(TRUTH) {
            for (i, key) in ["slope", "effective_slope"].into_iter().enumerate() {
                let slope = json!({"file": self.file(t), "column": self.column(t, i), "unit": "rad", "sd_deg": 0});
                references.insert(key.into(), slope);
            }
        }
        if !masses.is_empty() && masses.len() <= MAX_MASS_STEPS {
            // the first mass is there from the start
            let at_s = |i: usize, ns: i64| if i == 0 { 0.0 } else { ns as f64 / 1e9 };
            let steps = masses.iter().enumerate();
            let steps = steps.map(|(i, (ns, kg))| json!({"at_s": at_s(i, *ns), "kg": kg}));
            let mass = json!({"steps": steps.collect::<Vec<_>>(), "sd_kg": 0});
            references.insert("mass".into(), mass);
        }
        Value::Object(references)
    }
}
