//! All kinds of files. A new kind needs a variant and a row of the table.

use crate::files::load;
use crate::files::schema_words::Words;
use clap::ValueEnum;
use monorig_lab::batch::{Plan, StudyFile};
use monorig_lab::draw::RangesFile;
use monorig_lab::stress::{Condition, ConditionFile};
use monorig_lab::tuning::{TuningFile, TuningStudy, name_check};
use monorig_lab::verdicts::expected;
use monorig_logs::drive::VehicleFile;
use monorig_logs::map::{Map, MapFile};
use monorig_logs::replay::{self, ReplayOptions};
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::config::file::Document;
use monorig_sim::config::kinds::kind_of;
use monorig_sim::config::rail_profile::ProfileFile;
use monorig_sim::config::scenario::{ParameterFile, ScenarioFile};
use monorig_sim::config::sensor_sheet::Sheet;
use monorig_sim::config::track::TrackFile;
use monorig_sim::config::train::train_file::TrainFile;
use monorig_sim::config::train::unit::Unit;
use monorig_sim::config::train::unit_file::UnitFile;
use monorig_sim::error::Error;
use monorig_sim::rail::Rail;
use monorig_sim::rail::profile::Profile;
use monorig_sim::road::{Car, CarFile};
use monorig_sim::sensors::instruments::SheetFile;
use monorig_sim::train::Train;
use schemars::{Schema, schema_for};
use serde_json::Value;
use std::path::Path;

/// Kind of a file of monorig.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FileKind {
    /// A run: track, train, drive cycle, sensors, estimators, expectations
    Scenario,
    /// A rail
    Track,
    /// A train
    Train,
    /// A unit of a train
    Unit,
    /// A car
    Car,
    /// A sensor data sheet
    Sensors,
    /// The section of a rail
    RailProfile,
    /// Parameters of an estimator
    Parameters,
    /// A search for parameters
    Tuning,
    /// A scenario run many times with drawn values
    Study,
    /// Changes to scenarios under which estimators are tried
    Condition,
    /// Ranges that scenarios are drawn from
    Ranges,
    /// Quantities in the columns of a recorded log
    Map,
    /// A vehicle by its numbers, for maps
    Vehicle,
}

/// A file format: its name, its keys, its check.
pub struct FileFormat {
    /// The kind.
    pub kind: FileKind,
    /// Its name on the command line.
    pub name: &'static str,
    /// Its purpose.
    pub about: &'static str,
    /// Its JSON Schema, of all estimators and controllers.
    schema: fn() -> Schema,
    /// Places of words in the schema.
    words: &'static [(&'static str, Words)],
    /// Reads and checks a file and every file it names.
    pub check: fn(&Path, &Registry) -> Result<(), Error>,
}

/// Bounds and their known failures in a schema.
const METRIC_OF_BOUND: (&str, Words) = ("/$defs/Expectation/properties/metric", Words::Metric);
const METRIC_OF_FAILURE: (&str, Words) = ("/$defs/KnownFailure/properties/metric", Words::Metrics);
/// Instruments of events.
const INSTRUMENT: (&str, Words) = ("/$defs/Event/anyOf/2/properties/sensor", Words::Instruments);
/// Types of estimators, and estimators by their names.
const TYPE: (&str, Words) = ("/$defs/Settings/properties/is", Words::EstimatorTypes);
const ESTIMATORS: (&str, Words) = ("/properties/estimators", Words::Estimators);

/// Makes the list of formats from rows of kind, name and purpose; identifying keys; type; words; check.
macro_rules! kinds {
    ($($kind:ident $name:literal $about:literal; $file:ty; $words:expr; $check:expr;)*) => {
        &[$(FileFormat {
            kind: FileKind::$kind,
            name: $name,
            about: $about,
            schema: || schema_for!($file),
            words: $words,
            check: $check,
        }),*]
    };
}

/// Every kind.
pub const KINDS: &[FileFormat] = kinds! {
    Scenario "scenario" "what to run: track, train, drive cycle, sensors, estimators, events, expectations";
        ScenarioFile;
        &[TYPE, ESTIMATORS, METRIC_OF_BOUND, METRIC_OF_FAILURE, INSTRUMENT,
            ("/$defs/Controller/properties/kind", Words::Controllers), ("/$defs/PlantKind", Words::Plants),
            ("/properties/instruments", Words::OwnInstruments), ("/$defs/Published/properties/metric", Words::Metric)];
        load::check;
    Track "track" "a rail or a road: horizontal alignment, vertical profile or survey, joints"; TrackFile; &[];
        |path, _| Rail::load(path).map(drop);
    Train "train" "a train: units front to rear, load, limits, running resistance"; TrainFile; &[];
        |path, _| Train::load(path).map(drop);
    Unit "unit" "a unit of a train: data that a URDF cannot hold (springs, motor, gear, clamp, brake)"; UnitFile; &[];
        |path, _| Unit::load(path).map(drop);
    Car "car" "a car for a road: mass, wheels, tyres, motors, brakes, suspension, driver"; CarFile; &[];
        |path, _| Car::load(path).map(drop);
    Sensors "sensors" "a sensor data sheet: rates, errors, mounts"; SheetFile; &[];
        |path, _| Sheet::load(path).map(drop);
    RailProfile "rail-profile" "the section of an I-beam rail"; ProfileFile; &[];
        |path, _| Profile::load(path).map(drop);
    Ranges "ranges" "ranges for `monorig new courses`: trains, tracks, drives, instruments"; RangesFile; &[TYPE];
        |path, registry| RangesFile::load(path)?.check(path, registry);
    Condition "condition" "changes to a scenario under which `monorig stress` tries estimators"; ConditionFile; &[INSTRUMENT];
        |path, _| Condition::load(path).map(drop);
    Study "study" "a scenario run many times with drawn values"; StudyFile; &[];
        |path, registry| Plan::load(path, registry).map(drop);
    Tuning "tuning" "a tuning study: parameters to vary, runs, loss, method of search";
        TuningFile;
        &[("/properties/is", Words::EstimatorTypes), ("/$defs/Constraint/properties/metric", Words::Metric), ("/$defs/Term/properties/metric", Words::Metric)];
        |path, registry| TuningStudy::load(path, registry).map(drop);
    Map "map" "the quantities in the columns of a recorded log, and the reference of the estimates";
        MapFile;
        &[TYPE, ESTIMATORS, METRIC_OF_BOUND, METRIC_OF_FAILURE];
        |path, registry| {
            let mut map = Map::load(path)?;
            load::say_left_out(&map.leave_out_foreign(registry));
            let simulation = replay::simulation(&map, &ReplayOptions::default(), registry)?;
            expected::check(&simulation.scenario)
        };
    Vehicle "vehicle" "the data of a vehicle for estimators, for the map of a recorded log"; VehicleFile; &[];
        |path, _| VehicleFile::values(&Document::read(path)?).map(drop);
    Parameters "parameters" "parameters of an estimator, for scenarios to include"; ParameterFile; &[("/properties/estimator", Words::EstimatorTypes)];
        |path, registry| name_check::parameter_file(path, registry).map(drop);
};

impl FileFormat {
    /// JSON Schema with the names that the program knows.
    pub fn schema(&self, registry: &Registry) -> Schema {
        let mut schema = (self.schema)();
        let of_entry = schema.pointer("/$defs/Settings/properties");
        let of_entry = of_entry.and_then(Value::as_object).cloned();
        let of_entry: Vec<String> = of_entry.into_iter().flatten().map(|(key, _)| key).collect();
        for (place, words) in self.words {
            if let Some(key) = schema.pointer_mut(place).and_then(Value::as_object_mut) {
                words.put(key, place, registry, &of_entry);
            }
        }
        schema
    }
}

/// Returns the format of a kind.
pub fn row(kind: FileKind) -> Option<&'static FileFormat> {
    KINDS.iter().find(|row| row.kind == kind)
}

/// Kind of a file with these top-level keys, if the keys identify it.
pub fn recognise(keys: &[String]) -> Option<&'static FileFormat> {
    let name = kind_of(keys)?;
    KINDS.iter().find(|row| row.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use monorig_sim::config::kinds::kinds;

    fn keys_of(row: &FileFormat) -> Vec<&'static str> {
        kinds().find(|(name, _)| *name == row.name).unwrap().1
    }

    #[test]
    fn every_kind_has_a_row_and_is_recognised_by_its_own_keys() {
        for kind in FileKind::value_variants() {
            let row = row(*kind).unwrap();
            let name = kind.to_possible_value().unwrap();
            assert_eq!(name.get_name(), row.name);
            let keys: Vec<String> = keys_of(row).into_iter().map(str::to_owned).collect();
            assert_eq!(recognise(&keys).unwrap().name, row.name);
        }
        assert!(recognise(&["nothing".to_owned()]).is_none());
    }

    /// A key by which a kind is recognised must be one that its files can have.
    #[test]
    fn telling_keys_stand_in_the_schema() {
        for row in KINDS {
            let schema = row.schema(&Registry::default());
            for (place, _) in row.words {
                let key = schema.pointer(place).unwrap().as_object().unwrap();
                let mut words = ["enum", "anyOf", "properties"].iter();
                let has_words = words.any(|w| key.contains_key(*w));
                assert!(has_words, "{}: {place}", row.name);
            }
            let properties = schema.get("properties").unwrap();
            for key in keys_of(row) {
                assert!(properties.get(key).is_some(), "{}: {key}", row.name);
            }
        }
    }
}
