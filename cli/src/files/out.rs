//! The folder for results.

use crate::ui::errors::CliError;
use monorig_sim::record::whole;
use std::path::Path;

/// Makes the folder for results.
pub fn make(out: &Path) -> Result<(), CliError> {
    std::fs::create_dir_all(out).map_err(|source| CliError::Out {
        path: out.into(),
        source,
    })
}

/// Makes the folder for results and tries to write in it: before a long run, not after it.
pub fn prepare_out(out: &Path) -> Result<(), CliError> {
    let refused = |source| CliError::Out {
        path: out.into(),
        source,
    };
    make(out)?;
    let probe = out.join(format!(".monorig-{}", whole::unique()));
    std::fs::write(&probe, b"can this be written?").map_err(refused)?;
    std::fs::remove_file(&probe).map_err(refused)
}
