//! Conditions: files that say what is wrong in a run.

use crate::stress::NOMINAL;
use monorig_estimators::api::signals::VehicleData;
use monorig_sim::config::checked::{Positive, Version1};
use monorig_sim::config::file::{Document, input_error, name_of};
use monorig_sim::config::scenario::Event;
use monorig_sim::error::Error;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// A condition file: changes to a scenario.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ConditionFile {
    /// Format version, 1.
    pub(crate) version: Version1,
    /// The condition in a line.
    pub(crate) condition: String,
    /// Part of the drive that the condition changes.
    pub(crate) group: Group,
    /// Classes for the summary of results, such as `kind: [bias]`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) classes: Classes,
    /// Changes to the scenario, by path as in `--set`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) set: BTreeMap<String, serde_json::Value>,
    /// Nominal values of the vehicle for estimators and controller, as factors of the true values.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) told_factor: BTreeMap<ToldValue, Positive>,
    /// Events that are added to the events of the scenario.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) events: Vec<Event>,
}

/// Classes of a condition, by their kind.
pub type Classes = BTreeMap<String, BTreeSet<String>>;

impl ConditionFile {
    /// Name in a file.
    pub fn to_yaml(&self) -> String {
        // numbers and strings: nothing in here can fail to serialise
        serde_yaml::to_string(self).unwrap_or_default()
    }
}

/// Part of a drive.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Group {
    /// Nominal values of the vehicle.
    Told,
    /// Instruments.
    Instruments,
    /// Delivery of the samples.
    Delivery,
    /// Rail.
    Rail,
    /// Train, load and drive.
    Train,
}

/// A nominal value of the vehicle.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub(crate) enum ToldValue {
    /// Mass of the empty train.
    TareKg,
    /// Radius of the wheels.
    WheelRadiusM,
    /// Efficiency of the drives.
    Efficiency,
    /// Running-resistance coefficient.
    RunningResistance,
    /// Length of the load's chains.
    ChainM,
}

impl ToldValue {
    /// Key under `vehicle`, and the nominal value without a condition; `None` if the vehicle does not have the value.
    fn value(self, v: &VehicleData) -> (&'static str, Option<f64>) {
        match self {
            Self::TareKg => ("tare_kg", Some(v.tare_kg)),
            Self::WheelRadiusM => ("wheel_radius_m", Some(v.wheel_radius_m)),
            Self::Efficiency => ("efficiency", Some(v.efficiency)),
            Self::RunningResistance => ("running_resistance", Some(v.running_resistance)),
            Self::ChainM => ("chain_m", v.layout.map(|layout| layout.load.chain_m)),
        }
    }
}

/// A condition and its file.
#[derive(Clone, Debug)]
pub struct Condition {
    /// Name: that of the file.
    pub name: String,
    pub(crate) file: ConditionFile,
    document: Document,
}

/// Keys of a scenario that do not belong to a drive.
const OF_JUDGE: [&str; 7] = [
    "availability",
    "estimators",
    "expect",
    "in_loop",
    "integrity",
    "known_failures",
    "seeds",
];

impl Condition {
    /// Reads a file.
    pub fn load(path: &Path) -> Result<Self, Error> {
        let document = Document::read(path)?;
        let file: ConditionFile = document.parse()?;
        if file.condition.trim().is_empty() {
            let help = "write a line, such as `the wheels are worn by 3 %`";
            return Err(document.error("condition", "a condition needs a description", help));
        }
        let name = name_of(path)?;
        if name == NOMINAL {
            let help = "give the file another name";
            let message = format!("`{NOMINAL}` is the name of the row without a condition");
            return Err(document.error("", message, help));
        }
        let of_judge = |path: &&String| {
            let key = path.split(['.', '[']).next().unwrap_or_default();
            OF_JUDGE.contains(&key)
        };
        if let Some(path) = file.set.keys().find(of_judge) {
            let message = format!("`{path}` changes an estimator or the judgement, not the drive");
            let help = "change track, train, drive, sensors, events or the nominal vehicle";
            return Err(document.error(format!("set.{path}"), message, help));
        }
        for (i, event) in file.events.iter().enumerate() {
            event
                .sensor_fault()
                .map_err(|e| document.error(format!("events[{i}].{}", e.key), e.message, e.help))?;
        }
        Ok(Self {
            name,
            file,
            document,
        })
    }

    /// Reads all files of these folders: by group, then by name.
    pub fn load_all(folders: &[PathBuf]) -> Result<Vec<Self>, Error> {
        let mut all: Vec<Self> = Vec::new();
        for folder in folders {
            let refused = Error::at(folder);
            let mut files = Vec::new();
            for entry in std::fs::read_dir(folder).map_err(&refused)? {
                let path = entry.map_err(&refused)?.path();
                let is_yaml = path.extension().is_some_and(|e| e == "yaml");
                files.extend(is_yaml.then_some(path));
            }
            files.sort();
            if files.is_empty() {
                let help = "use a folder with files *.yaml; see `monorig check --schema condition`";
                return Err(input_error(
                    folder,
                    "",
                    "this folder has no condition",
                    help,
                ));
            }
            for path in files {
                let new = Self::load(&path)?;
                if let Some(there) = all.iter().find(|c| c.name == new.name) {
                    let message = format!("{} also has this name", there.document.path().display());
                    return Err(new
                        .document
                        .error("", message, "give the file another name"));
                }
                all.push(new);
            }
        }
        all.sort_by(|a, b| (a.file.group, &a.name).cmp(&(b.file.group, &b.name)));
        Ok(all)
    }

    /// The condition in a line.
    pub fn words(&self) -> &str {
        self.file.condition.trim()
    }

    /// Part of the drive that the condition changes.
    pub fn group(&self) -> Group {
        self.file.group
    }

    /// Classes for the summary of results.
    pub(crate) fn classes(&self) -> &Classes {
        &self.file.classes
    }

    /// True if this text is a part of its name, or is its group.
    pub fn is_called(&self, text: &str) -> bool {
        let group = serde_json::to_value(self.file.group);
        self.name.contains(text) || group.is_ok_and(|g| g == text)
    }

    /// File name.
    pub(crate) fn file_name(&self) -> String {
        let name = self.document.path().file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    }

    /// Time after the last change: the last begin or end of its events, s; 0 without any.
    pub fn over_s(&self) -> f64 {
        let times = self.file.events.iter().filter_map(Event::times_s);
        times.fold(0.0, |last: f64, (from, to)| last.max(to.unwrap_or(from)))
    }

    /// Changes of the condition to a scenario with this nominal vehicle.
    pub(crate) fn changes(&self, vehicle: &VehicleData) -> Vec<(String, String)> {
        let set = self.file.set.iter();
        let mut all: Vec<_> = set.map(|(path, v)| (path.clone(), v.to_string())).collect();
        for (told, factor) in &self.file.told_factor {
            let (key, value) = told.value(vehicle);
            // a point has no chains
            if let Some(value) = value {
                all.push((format!("vehicle.{key}"), (value * factor.get()).to_string()));
            }
        }
        for event in &self.file.events {
            let event = serde_json::to_string(event).unwrap_or_default();
            all.push(("events[+]".to_owned(), event));
        }
        all
    }

    /// Error of a scenario under this condition, at its key in the condition's file.
    pub(crate) fn refused(&self, scenario: &str, e: &Error) -> Error {
        let (key, said, help) = match e {
            Error::Input(e) => (e.key.as_str(), e.message.clone(), e.help.clone()),
            e => (
                "",
                e.to_string(),
                "use values that the scenario can have".to_owned(),
            ),
        };
        let place = match key {
            _ if key.starts_with("events") => "events",
            _ if key.starts_with("vehicle") && self.file.set.is_empty() => "told_factor",
            _ => "set",
        };
        let message = format!("{scenario} cannot be run under this condition: {key}: {said}");
        self.document.error(place, message, help)
    }
}
