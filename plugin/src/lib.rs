//! Estimators of shared libraries that have the functions of `monorig_estimator.h`. A scenario names one by
//! `library: ./mine.so`; it is then checked, built and run as ours are.
//!
//! | file | what it holds |
//! |---|---|
//! | `library` | a library: found, checked, its functions |
//! | `foreign` | an estimator of it in a run |

mod foreign;
mod library;

use library::Library;
use monorig_estimators::Vehicle;
use monorig_sim::closed_loop::registry::{
    BoxedEstimator, EstimatorType, NamedSettings, Refusal, Registry,
};
use std::path::Path;

/// Lets scenarios that are built with this registry name libraries.
pub fn loads_libraries(mut registry: Registry) -> Registry {
    registry.load_libraries_with(estimator_of);
    registry
}

/// The estimator of this name in a library, or the only one there is.
fn estimator_of(path: &Path, name: Option<&str>) -> Result<EstimatorType, Refusal> {
    let library = Library::load(path)?;
    let name = library.choose(name)?;
    let groups = library.parameters(name)?;
    let build = move |vehicle: &Vehicle, settings: NamedSettings<'_>| {
        let built = foreign::Foreign::build(library, name, vehicle, settings)?;
        Ok(Box::new(built) as BoxedEstimator)
    };
    Ok(EstimatorType::new(name, groups, build))
}
