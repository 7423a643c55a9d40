//! Foreign estimators and controllers: estimators of shared libraries that have the functions of `monorig_estimator.h`,
//! and FMUs of both. A scenario names one by `library: ./mine.so` or `fmu: ./mine.fmu`; it is then checked, built and
//! run as ours are. An estimator that runs elsewhere, such as on a vehicle's controller, is reached by CAN frames:
//! `external: {udp: "127.0.0.1:47800"}`.
//!
//! | file | what it holds |
//! |---|---|
//! | `library` | a library: found, checked, its functions |
//! | `load` | what a scenario names in a library or an FMU |
//! | `foreign` | an estimator of it in a run |
//! | `fmu/` | an FMU: unpacked, checked, its functions, an instance of it in a run |
//! | `signals` `unit` | names of inputs and outputs in an FMU, and their units |
//! | `external/` | an estimator outside of the program in a run, the ways to it; ours as such a one |
//! | `owned_process` | a process that is started and ended |
//! | `parent` | processes that run parts |
//! | `remote` | an estimator or a controller in such a process |
//! | `child` | the process that runs a part |
//! | `protocol` | the messages between the two |

#[cfg(unix)]
mod child;
pub mod external;
mod fmu;
mod foreign;
mod library;
mod load;
#[cfg(unix)]
mod owned_process;
#[cfg(unix)]
mod parent;
#[cfg(unix)]
mod protocol;
#[cfg(unix)]
mod remote;
pub mod signals;
pub mod unit;

#[cfg(unix)]
pub use child::serve;

use load::{load, load_controller};
use monorig_c::NominalVehicle;
use monorig_estimators::Vehicle;
use monorig_sim::closed_loop::registry::Registry;

/// A vehicle as a file in C, for a program with `monorig_estimator.h`.
pub fn in_c(vehicle: &Vehicle) -> String {
    let text = format!("{:?}", NominalVehicle::from(vehicle)).replace("NominalVehicle ", "");
    let text = text
        .replace("Mass ", "")
        .replace('[', "{")
        .replace(']', "}");
    let text = text.replace("NaN", "NAN");
    let words = text.split(' ').map(|word| match word.strip_suffix(':') {
        Some(field) => format!(".{field} ="),
        None => word.to_owned(),
    });
    // places without a mass are not named: C fills them with 0
    let unused = ", { .places_m = {0.0, 0.0}, .mass_kg = 0.0, .depth_m = 0.0 }";
    let text = words.collect::<Vec<_>>().join(" ").replace(unused, "");
    let text = text.replace(", .", ",\n  .");
    let head = "#include <math.h>\n\n#include \"monorig_estimator.h\"\n";
    format!("{head}\nstatic const monorig_vehicle vehicle = {text};\n")
}

/// Lets scenarios of this registry name libraries and FMUs, which run inside this program: a crash in one ends it.
pub fn loads_libraries(mut registry: Registry) -> Registry {
    registry.load_libraries_with(|path, settings, clock| match &settings.external {
        Some(external) => external::estimator_of(external, clock),
        None => load(path, settings),
    });
    registry.load_controllers_with(load_controller);
    registry
}

/// Lets scenarios of this registry name libraries and FMUs, which run in their own processes: a crash in one is an
/// error of its run. `program` is what to start: it calls [`serve`].
#[cfg(unix)]
pub fn guards_libraries(mut registry: Registry, program: Vec<std::ffi::OsString>) -> Registry {
    let host = std::sync::Arc::new(parent::Host::new(program));
    let of_controllers = host.clone();
    registry.load_libraries_with(move |path, settings, clock| match &settings.external {
        Some(external) => external::estimator_of(external, clock),
        None => host.estimator(path, settings),
    });
    registry.load_controllers_with(move |path, settings| of_controllers.controller(path, settings));
    registry
}
