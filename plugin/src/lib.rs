//! Estimators of others: of shared libraries that have the functions of `monorig_estimator.h`, and FMUs. A scenario
//! names one by `library: ./mine.so` or `fmu: ./mine.fmu`; it is then checked, built and run as ours are.
//!
//! | file | what it holds |
//! |---|---|
//! | `library` | a library: found, checked, its functions |
//! | `foreign` | an estimator of it in a run |
//! | `fmu/` | an FMU: unpacked, checked, its functions, an instance of it in a run |
//! | `signals` `unit` | names of inputs and outputs in an FMU, and their units |

mod fmu;
mod foreign;
mod library;
pub mod signals;
pub mod unit;

use library::Library;
use monorig_estimators::Vehicle;
use monorig_sim::closed_loop::registry::{
    BoxedEstimator, EstimatorType, NamedSettings, Refusal, Registry,
};
use monorig_sim::config::scenario::Settings;
use std::path::Path;

/// Lets scenarios that are built with this registry name libraries and FMUs.
pub fn loads_libraries(mut registry: Registry) -> Registry {
    registry.load_libraries_with(|path, settings| match settings.is_fmu {
        true => fmu::estimator_of(path, settings),
        false => estimator_of(path, settings),
    });
    registry
}

/// The estimator that the settings name in a library, or the only one there is.
fn estimator_of(path: &Path, settings: &Settings) -> Result<EstimatorType, Refusal> {
    let library = Library::load(path)?;
    let name = library.choose(settings.is.as_deref())?;
    let groups = library.parameters(name)?;
    let build = move |vehicle: &Vehicle, settings: NamedSettings<'_>| {
        let built = foreign::Foreign::build(library, name, vehicle, settings)?;
        Ok(Box::new(built) as BoxedEstimator)
    };
    Ok(EstimatorType::new(name, groups, build))
}
