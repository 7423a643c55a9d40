//! An estimator or the plant of a scenario, converted into an FMU.

use crate::package::Package;
use crate::part::{EstimatorPart, LIBRARY, Part, PlantPart, measured, plant_alone};
use monorig_estimators::Vehicle;
use monorig_estimators::api::snapshot::SnapshotError;
use monorig_logs::drive::VehicleFile;
use monorig_sim::closed_loop::registry::{BoxedEstimator, EstimatorType, Refusal, Registry};
use monorig_sim::config::scenario::Settings;
use monorig_sim::error::Error;
use std::collections::BTreeMap;
use std::path::Path;

/// An estimator for a vehicle, with its type.
fn built_for(
    vehicle: &Vehicle,
    name: &str,
    settings: &Settings,
    registry: &Registry,
) -> Result<(EstimatorType, BoxedEstimator), Error> {
    let refused =
        |w: Refusal| Error::from(monorig_sim::error::DataError::new("", w.message, w.help));
    let of_type = registry.estimator_of(name, settings).map_err(refused)?;
    for (key, value) in settings.named() {
        of_type.check(key, value).map_err(refused)?;
    }
    let built = of_type.build(vehicle, &settings.named()).map_err(refused)?;
    Ok((of_type, built))
}

/// The vehicle of a scenario as its data sheet has it.
pub fn vehicle(scenario: &Path) -> Result<Vehicle, Error> {
    Ok(plant_alone(scenario, &[])?.told_exactly().build(1)?.vehicle)
}

/// An estimator that is ready to run, for the vehicle of a scenario.
pub fn built(
    name: &str,
    settings: &Settings,
    registry: &Registry,
    scenario: &Path,
) -> Result<BoxedEstimator, Error> {
    Ok(built_for(&vehicle(scenario)?, name, settings, registry)?.1)
}

/// An estimator of the registry, or of a library that the settings name, for the vehicle of a scenario.
pub fn estimator(
    name: &str,
    settings: &Settings,
    registry: &Registry,
    scenario: &Path,
) -> Result<Package, Error> {
    let simulation = plant_alone(scenario, &[])?.told_exactly().build(1)?;
    let vehicle = &simulation.vehicle;
    let (of_type, built) = built_for(vehicle, name, settings, registry)?;
    let mut names: Vec<String> = measured(&simulation).map(|s| s.name().to_owned()).collect();
    names.dedup();
    let part = EstimatorPart {
        name: of_type.name().to_owned(),
        in_library: settings.file().is_some(),
        vehicle: VehicleFile::of(vehicle),
        parameters: settings.values.clone(),
        measured: names,
        keeps_state: matches!(built.snapshot(&mut []), Ok(_) | Err(SnapshotError::Room(_))),
    };
    let mut files = BTreeMap::new();
    if let Some(library) = settings.file() {
        let bytes = monorig_sim::config::file::read_library(Path::new(library))?;
        files.insert(LIBRARY.to_owned(), bytes.to_vec());
    }
    let about = match of_type.description() {
        "" => "An estimator of mass and slope.",
        sentence => sentence,
    };
    Ok(Package::new(
        Part::Estimator(Box::new(part)),
        about.to_owned(),
        None,
        files,
    ))
}

/// The plant of a scenario with its instruments, with the files that it is read from.
pub fn plant(scenario: &Path, set: &[(String, String)]) -> Result<Package, Error> {
    let simulation = plant_alone(scenario, set)?.build(1)?;
    let loaded = &simulation.scenario;
    let folder = loaded.path().parent().unwrap_or(Path::new(""));
    let named = loaded.inputs().named(folder);
    let ups = |name: &String| name.split('/').take_while(|part| *part == "..").count();
    let deepest = named.keys().map(ups).max().unwrap_or(0);
    let mut files = BTreeMap::new();
    for (name, bytes) in &named {
        if Path::new(name).is_absolute() {
            return Err(loaded.error(
                "",
                format!("it names {name} by an absolute path"),
                "use a path relative to its folder: an FMU is used on other machines",
            ));
        }
        // the scenario stands so deep that every path up from it stays in `resources/`
        let up = ups(name);
        let below: Vec<&str> = (up..deepest)
            .map(|_| "in")
            .chain(name.split('/').skip(up))
            .collect();
        files.insert(below.join("/"), bytes.to_vec());
    }
    let file = loaded
        .path()
        .file_name()
        .unwrap_or_default()
        .to_string_lossy();
    let part = PlantPart {
        name: loaded.name.clone(),
        file: format!("{}{file}", "in/".repeat(deepest)),
        set: set.to_vec(),
    };
    let (about, step_s) = (loaded.file.why.clone(), simulation.dt_s);
    Ok(Package::new(Part::Plant(part), about, Some(step_s), files))
}
