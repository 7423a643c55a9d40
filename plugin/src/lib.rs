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
use std::path::Path;

/// A part that is a library.
#[cfg(unix)]
const LIBRARY: &str = "library";

/// Lets scenarios that are built with this registry name libraries, which run inside of this program: a crash in one
/// ends it.
pub fn loads_libraries(mut registry: Registry) -> Registry {
    registry.load_libraries_with(estimator_of);
    registry
}

/// Lets scenarios that are built with this registry name libraries, which run in processes of their own: a crash in
/// one is an error of its run. `program` is what to start: it calls [`serve`].
#[cfg(unix)]
pub fn guards_libraries(mut registry: Registry, program: Vec<std::ffi::OsString>) -> Registry {
    let host = std::sync::Arc::new(parent::Host::new(program));
    registry.load_libraries_with(move |path, name| host.estimator(LIBRARY, path, name));
    registry
}

/// The part of a process.
#[cfg(unix)]
fn part(kind: &str, path: &Path, name: Option<&str>) -> Result<EstimatorType, Refusal> {
    match kind {
        LIBRARY => estimator_of(path, name),
        _ => Err(Refusal::new(
            format!("no part is a {kind}"),
            "the same program at both ends",
        )),
    }
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
