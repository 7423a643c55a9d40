//! The error of a result that cannot be used.

use monorig_sim::config::file::input_error;
use monorig_sim::error::Error;
use std::path::Path;

/// Help for a result that cannot be used.
pub(crate) const MAKE_AGAIN: &str = "make the result again with `monorig run`";

/// Makes the error of a result that cannot be used.
pub(crate) fn broken(path: &Path, message: String) -> Error {
    input_error(path, "", message, MAKE_AGAIN)
}
