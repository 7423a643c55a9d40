//! Identity of this program.

use monorig_sim::record::identity::Identity;

/// Version, git revision and hash of the program file that is running.
pub fn identity() -> Identity {
    Identity::of_program(option_env!("MONORIG_REVISION"))
}
