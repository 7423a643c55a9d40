//! Estimators of shared libraries that have the functions of `monorig_estimator.h`. A scenario names one by
//! `library: ./mine.so`; it is then checked, built and run as ours are.
//!
//! | file | what it holds |
//! |---|---|
//! | `library` | a library: found, checked, its functions |
//! | `foreign` | an estimator of it in a run |
//! | `parent` | parts in processes of their own |
//! | `child` | the process that runs a part |
//! | `protocol` | the messages between the two |

#[cfg(unix)]
mod child;
mod foreign;
mod library;
#[cfg(unix)]
mod parent;
#[cfg(unix)]
mod protocol;

#[cfg(unix)]
pub use child::serve;

use library::Library;
use monorig_estimators::Vehicle;
use monorig_sim::closed_loop::registry::{
    BoxedEstimator, EstimatorType, NamedSettings, Refusal, Registry,
};
use monorig_sim::config::scenario::Settings;
use std::path::Path;

/// Lets scenarios that are built with this registry name libraries, which run inside of this program: a crash in one
/// ends it.
pub fn loads_libraries(mut registry: Registry) -> Registry {
    registry.load_libraries_with(|path, name| load(path, &settings(name)));
    registry
}

/// Lets scenarios that are built with this registry name libraries, which run in processes of their own: a crash in
/// one is an error of its run. `program` is what to start: it calls [`serve`].
#[cfg(unix)]
pub fn guards_libraries(mut registry: Registry, program: Vec<std::ffi::OsString>) -> Registry {
    let host = std::sync::Arc::new(parent::Host::new(program));
    registry.load_libraries_with(move |path, name| host.estimator(path, &settings(name)));
    registry
}

/// The keys of a scenario for the estimator of this name, or for the only one.
fn settings(name: Option<&str>) -> Settings {
    name.map_or_else(Settings::default, Settings::of_type)
}

/// The estimator that the settings name in a library, or the only one there is.
fn load(path: &Path, settings: &Settings) -> Result<EstimatorType, Refusal> {
    let library = Library::load(path)?;
    let name = library.choose(settings.is.as_deref())?;
    let groups = library.parameters(name)?;
    let build = move |vehicle: &Vehicle, settings: NamedSettings<'_>| {
        let built = foreign::Foreign::build(library, name, vehicle, settings)?;
        Ok(Box::new(built) as BoxedEstimator)
    };
    Ok(EstimatorType::new(name, groups, build))
}
