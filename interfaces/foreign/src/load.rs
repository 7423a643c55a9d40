//! The estimator or the controller that a scenario names in a file, inside this program.

use crate::library::Library;
use crate::{fmu, foreign};
use monorig_estimators::Vehicle;
use monorig_sim::closed_loop::registry::{
    BoxedEstimator, ControllerType, EstimatorType, NamedSettings, Refusal,
};
use monorig_sim::config::scenario::{ControllerSettings, Settings};
use std::path::Path;

/// The estimator that the settings name in a library or an FMU, or its only estimator.
pub(crate) fn load(path: &Path, settings: &Settings) -> Result<EstimatorType, Refusal> {
    if settings.fmu.is_some() {
        return fmu::estimator_of(path, settings);
    }
    let library = Library::load(path)?;
    let name = library.choose(settings.is.as_deref())?;
    let groups = library.parameters(name)?;
    let build = move |vehicle: &Vehicle, settings: NamedSettings<'_>| {
        let built = foreign::Foreign::build(library, name, vehicle, settings)?;
        Ok(Box::new(built) as BoxedEstimator)
    };
    Ok(EstimatorType::new(name, groups, build))
}

/// The controller in an FMU.
pub(crate) fn load_controller(
    path: &Path,
    settings: &ControllerSettings,
) -> Result<ControllerType, Refusal> {
    fmu::controller_of(path, settings)
}
