//! Identity of this program.

use monorig_sim::record::identity::Identity;
use std::sync::OnceLock;

/// Version, git revision and hash of the program file that is running.
pub(crate) fn identity() -> Identity {
    Identity::of_program(option_env!("MONORIG_REVISION"))
}

/// Text of `--version`: version, git revision and hash of the program; system, compiler and viewer of its build.
/// Without this option only the version is made: the hash takes time.
pub(crate) fn version() -> &'static str {
    static VERSION: OnceLock<String> = OnceLock::new();
    let asked = std::env::args_os().any(|a| a == "--version" || a == "-V");
    match asked {
        true => VERSION.get_or_init(|| {
            let viewer = match cfg!(feature = "viewer") {
                true => "with the viewer (Rerun 0.36.3)",
                false => "without the viewer",
            };
            format!("{}\n{}, {viewer}", identity(), env!("MONORIG_BUILD"))
        }),
        false => env!("CARGO_PKG_VERSION"),
    }
}
