//! Loads a scenario from its file, ready to run.

use super::{
    Availability, Expectation, Integrity, KnownFailure, ParameterFile, Record, ScenarioFile,
    Settings, Stop, Way, check,
};
use crate::config::checked::Version1;
use crate::config::file::{Document, Sets, input_error, name_of, read_library};
use crate::config::input_files::InputFiles;
use crate::error::Error;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A checked scenario and where its files are. As JSON (for the manifest) it holds what decides the result, and no
/// paths of this machine.
#[derive(Clone, Debug, Serialize)]
pub struct Scenario {
    /// File name without its ending.
    pub name: String,
    /// The contents of the file, with `--set` applied and defaults filled in.
    #[serde(flatten)]
    pub file: ScenarioFile,
    /// The track file, found from the scenario's folder.
    #[serde(skip)]
    pub(crate) track: PathBuf,
    /// The train or car file, found from the scenario's folder.
    #[serde(skip)]
    pub(crate) vehicle: PathBuf,
    /// The sensor data sheet, found from the scenario's folder.
    #[serde(skip)]
    pub sensors: PathBuf,
    /// Parameter files of the estimators.
    #[serde(skip)]
    included: BTreeMap<String, PathBuf>,
    /// Sources of a recorded drive that is played back, for the manifest; none for a simulation.
    #[serde(skip_serializing_if = "Option::is_none")]
    log: Option<serde_json::Value>,
    /// SHA-256 of files that are too long to be kept in memory, by name.
    #[serde(skip)]
    digests: BTreeMap<String, String>,
    /// Changes to the files that the scenario names: what `--set` changed there is in no file.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    changed: Vec<(String, String)>,
    #[serde(skip)]
    sets: Sets,
    #[serde(skip)]
    document: Document,
    #[serde(skip)]
    inputs: InputFiles,
}

/// The parts of a scenario that the map file of a recorded drive has too.
#[derive(Clone, Debug, Default)]
pub struct LogScenario {
    /// Name, in recordings and of the folder of results.
    pub name: String,
    /// Description of the recording.
    pub why: String,
    /// Estimators by name, with their parameters.
    pub estimators: BTreeMap<String, Settings>,
    /// Bounds to hold.
    pub expect: Vec<Expectation>,
    /// Shares of the time in which estimates must be marked valid.
    pub availability: Availability,
    /// Limits beyond which an estimate marked valid is misleading.
    pub integrity: Integrity,
    /// Bounds that cannot hold, for reasons of physics.
    pub known_failures: Vec<KnownFailure>,
    /// Recording rates.
    pub record: Record,
    /// Sources of the recording, for the manifest.
    pub log: serde_json::Value,
    /// SHA-256 of the files of the log, by name.
    pub digests: BTreeMap<String, String>,
}

/// Keys under which a scenario names files that `--set` can change.
const FILES: &[&str] = &["track", "train", "car", "sensors"];

/// Reads the parameter files that estimators name under `from`, relative to the document's folder; returns the files by
/// the name of the estimator.
fn include_parameters(
    estimators: &mut BTreeMap<String, Settings>,
    document: &Document,
) -> Result<BTreeMap<String, PathBuf>, Error> {
    let folder = document.path().parent().unwrap_or(Path::new(""));
    let mut included = BTreeMap::new();
    for (name, settings) in estimators {
        let Some(from) = &settings.from else { continue };
        let key = format!("estimators.{name}.from");
        let found = folder.join(from);
        crate::config::file::exists(&found)
            .map_err(|(message, help)| document.error(key.clone(), message, help))?;
        let parameters = ParameterFile::read(&found)?;
        let type_name = settings.type_name(name);
        // the name of the only one in a library or an FMU is known later; its parameters are checked then
        let known = settings.file().is_none() || settings.is.is_some();
        if known && parameters.estimator != type_name {
            return Err(document.error(
                key,
                format!("this file has parameters of `{}`", parameters.estimator),
                match &settings.is {
                    Some(_) => format!("name a parameter file of `{type_name}`"),
                    None => format!(
                        "name a parameter file of `{name}`, or write `is: {}`",
                        parameters.estimator
                    ),
                },
            ));
        }
        settings.include(&parameters);
        included.insert(name.clone(), found);
    }
    Ok(included)
}

/// Finds a library or an FMU that the document names at a key, from its folder, and reads it: the inputs have its
/// digest.
fn find_library(key: &str, name: &str, document: &Document) -> Result<PathBuf, Error> {
    let folder = document.path().parent().unwrap_or(Path::new(""));
    let found = folder.join(name);
    crate::config::file::exists(&found)
        .map_err(|(message, help)| document.error(key, message, help))?;
    read_unchanged(key, &found, document)?;
    Ok(found)
}

/// Reads the files of foreign parts. It runs from disk, so it must still be there as it was first read.
fn read_unchanged(key: &str, file: &Path, document: &Document) -> Result<(), Error> {
    let now = std::fs::read(file).map_err(Error::at(file))?;
    match *read_library(file)? == *now {
        true => Ok(()),
        false => Err(document.error(
            key,
            format!("{} was changed since the first run", file.display()),
            "start again in another folder: monorig does not join the runs of two programs",
        )),
    }
}

/// Finds the libraries of all estimators. Programs outside start in the folder of the document.
fn find_libraries(
    estimators: &mut BTreeMap<String, Settings>,
    document: &Document,
) -> Result<(), Error> {
    for (name, settings) in estimators {
        if let Some(external) = &mut settings.external {
            external.folder = document.path().parent().unwrap_or(Path::new("")).into();
            for file in external.files() {
                read_unchanged(&format!("estimators.{name}.external"), &file, document)?;
            }
            let elsewhere = !matches!(external.way, Way::Process(_));
            if let Some(inputs) = InputFiles::current().filter(|_| elsewhere) {
                inputs.runs_elsewhere(&external.to_string());
            }
        }
        if let Some(file) = settings.file() {
            let key = format!("estimators.{name}.{}", settings.foreign_key());
            settings.library_file = Some(find_library(&key, file, document)?);
        }
    }
    Ok(())
}

fn checked(file: &ScenarioFile, document: &Document) -> Result<(), Error> {
    check::check(file).map_err(|w| document.error(w.key, w.message, w.help))
}

impl Scenario {
    /// Read and check a scenario, with `--set path=value` applied in the order given; a path such as `track.name`
    /// reaches into the file that the scenario names under `track`. The files it names must be there; their contents
    /// are checked when they are read.
    pub fn load(path: &Path, overrides: &[(String, String)]) -> Result<Self, Error> {
        Self::load_with(path, &Sets::new(overrides))
    }

    /// Loads a scenario with changes that do not come from the command line.
    pub fn load_with(path: &Path, sets: &Sets) -> Result<Self, Error> {
        let whole = InputFiles::current();
        let inputs = whole.map_or_else(InputFiles::default, InputFiles::part_of);
        inputs.during(|| Self::read(path, sets.clone(), inputs.clone()))
    }

    fn read(path: &Path, sets: Sets, inputs: InputFiles) -> Result<Self, Error> {
        let mut document = Document::read(path)?;
        document.apply(&sets.own(FILES))?;
        let mut file: ScenarioFile = document.parse()?;
        checked(&file, &document)?;
        file.physics.plant = Some(file.plant());
        let folder = path.parent().unwrap_or(Path::new(""));
        let find = |key: &str, name: &str| -> Result<PathBuf, Error> {
            let found = folder.join(name);
            match crate::config::file::exists(&found) {
                Ok(()) => Ok(found),
                Err((message, help)) => Err(document.error(key, message, help)),
            }
        };
        let included = include_parameters(&mut file.estimators, &document)?;
        find_libraries(&mut file.estimators, &document)?;
        let controller = &mut file.drive.controller;
        if let Some(fmu) = &controller.fmu {
            controller.fmu_file = Some(find_library("drive.controller.fmu", fmu, &document)?);
        }
        let track = find("track", &file.track)?;
        // one of the two is there, as checked
        let vehicle = match &file.car {
            Some(car) => find("car", car)?,
            None => find("train", file.train.as_deref().unwrap_or_default())?,
        };
        Ok(Self {
            name: name_of(path)?,
            track,
            vehicle,
            sensors: find("sensors", &file.sensors)?,
            file,
            included,
            log: None,
            digests: BTreeMap::new(),
            changed: FILES
                .iter()
                .flat_map(|key| {
                    let of = sets.of(key);
                    let full = of.iter().map(|(p, v)| (format!("{key}.{p}"), v.clone()));
                    full.collect::<Vec<_>>()
                })
                .collect(),
            sets,
            document,
            inputs,
        })
    }

    /// A scenario without a file, for a track and a train or a car of these names: without sensors, drive cycle and end
    /// of the run.
    pub(crate) fn in_code(track: &str, train: Option<&str>, car: Option<&str>) -> Self {
        let name = "simulation".to_owned();
        let file = ScenarioFile {
            version: Version1,
            why: "Built in code.".into(),
            track: track.into(),
            train: train.map(str::to_owned),
            car: car.map(str::to_owned),
            load: Default::default(),
            start: Default::default(),
            stop: Stop {
                after_s: None,
                at_m: None,
            },
            physics: Default::default(),
            drive: Default::default(),
            sensors: String::new(),
            instruments: BTreeMap::new(),
            vehicle: Default::default(),
            estimators: BTreeMap::new(),
            in_loop: None,
            events: Vec::new(),
            obstacles: Vec::new(),
            roadway: None,
            seeds: Default::default(),
            record: Default::default(),
            expect: Vec::new(),
            availability: Default::default(),
            integrity: Default::default(),
            known_failures: Vec::new(),
            published: Vec::new(),
        };
        Self {
            name,
            file,
            track: PathBuf::new(),
            vehicle: PathBuf::new(),
            sensors: PathBuf::new(),
            included: BTreeMap::new(),
            log: None,
            digests: BTreeMap::new(),
            changed: Vec::new(),
            sets: Sets::default(),
            document: Document::default(),
            inputs: InputFiles::default(),
        }
    }

    /// True for a recorded drive, whose truth is a reference.
    pub fn is_recorded(&self) -> bool {
        self.log.is_some()
    }

    /// Returns the part of a recorded drive that the map selects; `None` for the whole drive.
    pub fn trim(&self) -> Option<&serde_json::Value> {
        let trim = self.log.as_ref()?.pointer("/map/trim")?;
        trim.as_object()
            .is_some_and(|t| !t.is_empty())
            .then_some(trim)
    }

    /// Makes the scenario of a recorded drive from the estimators, bounds and recording in its map file `document`.
    pub(crate) fn of_log(
        log: LogScenario,
        document: Document,
        inputs: InputFiles,
    ) -> Result<Self, Error> {
        let mut scenario = Self::in_code("", None, None);
        scenario.name = log.name;
        scenario.document = document;
        scenario.inputs = inputs;
        scenario.log = Some(log.log);
        scenario.digests = log.digests;
        let file = &mut scenario.file;
        file.why = log.why;
        file.estimators = log.estimators;
        file.expect = log.expect;
        file.availability = log.availability;
        file.integrity = log.integrity;
        file.known_failures = log.known_failures;
        file.record = log.record;
        scenario.included = include_parameters(&mut scenario.file.estimators, &scenario.document)?;
        find_libraries(&mut scenario.file.estimators, &scenario.document)?;
        check::check_log(&scenario.file)
            .map_err(|w| scenario.document.error(w.key, w.message, w.help))?;
        Ok(scenario)
    }

    /// Checks a scenario again after changes in code, as far as possible without track, vehicle and sensors.
    pub(crate) fn check(&mut self) -> Result<(), Error> {
        checked(&self.file, &self.document)?;
        self.file.physics.plant = Some(self.file.plant());
        Ok(())
    }

    /// The changes to the file that the scenario names under `key`.
    pub fn sets(&self, key: &str) -> Sets {
        self.sets.of(key)
    }

    /// Files from which the scenario was read, and files that were read to build its simulation.
    pub fn inputs(&self) -> &InputFiles {
        &self.inputs
    }

    /// SHA-256 of these files by name relative to its folder.
    pub fn input_digests(&self) -> BTreeMap<String, String> {
        let folder = self.path().parent().unwrap_or(Path::new(""));
        let mut all = self.inputs.digests(folder);
        all.extend(self.digests.clone());
        all
    }

    /// The seeds to run.
    pub fn seeds(&self) -> &[u64] {
        self.file.seeds.as_slice()
    }

    /// The scenario file.
    pub fn path(&self) -> &Path {
        self.document.path()
    }

    /// Error at a key of the scenario that was found later, when train, track and sensors were put together.
    pub fn error(
        &self,
        key: impl Into<String>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Error {
        self.document.error(key, message, help)
    }

    /// An error at a parameter of an estimator: where the scenario or the parameter file gives it.
    pub(crate) fn parameter_error(
        &self,
        estimator: &str,
        key: &str,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Error {
        let settings = self.file.estimators.get(estimator);
        let inherited = settings.is_some_and(|s| s.inherits(key));
        match self.included.get(estimator) {
            Some(file) if inherited => {
                input_error(file, format!("parameters.{key}"), message, help)
            }
            _ => self.error(format!("estimators.{estimator}.{key}"), message, help),
        }
    }
}
