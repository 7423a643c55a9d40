//! Steps of a run, and FMUs of ours in files.

mod steps;

use monorig_fmu::{Fmi, Package};
use monorig_plugin::loads_libraries;
use monorig_sim::closed_loop::registry::{EstimatorType, Registry};
use monorig_sim::config::scenario::Settings;
use std::path::{Path, PathBuf};
pub use steps::{bits, names, project, scenario, simulation, steps};

/// An FMU as a file.
pub fn packed(package: &Package, fmi: Fmi, folder: &Path) -> PathBuf {
    let file = folder.join(format!("{}_{fmi:?}.fmu", package.name()));
    let bytes = package
        .bytes(fmi, &monorig_fmu::library().unwrap(), &[])
        .unwrap();
    std::fs::write(&file, bytes).unwrap();
    file
}

/// One of ours as an FMU in a file.
pub fn exported(settings: &Settings, scenario: &Path, fmi: Fmi, folder: &Path) -> PathBuf {
    let name = settings.is.as_deref().unwrap();
    let registry = loads_libraries(Registry::default());
    packed(
        &monorig_fmu::estimator(name, settings, &registry, scenario).unwrap(),
        fmi,
        folder,
    )
}

/// The type of estimator that an FMU is.
pub fn imported(file: &Path) -> EstimatorType {
    let settings = Settings::default().in_fmu("it.fmu", file.to_owned());
    let registry = loads_libraries(Registry::default());
    registry.estimator_of("it", &settings).unwrap()
}
