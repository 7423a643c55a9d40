//! Copies of the files that a study was made from, kept with its results.

use super::whole;
use crate::config::input_files::InputFiles;
use crate::error::Error;
use std::path::Path;

/// Keep a copy of every file in `folder`, which is made if need be. The name of a copy is its SHA-256, so that studies,
/// and shards of a study, can share the folder.
pub fn keep(files: &InputFiles, folder: &Path) -> Result<(), Error> {
    std::fs::create_dir_all(folder).map_err(Error::at(folder))?;
    for (digest, bytes) in files.contents() {
        let place = folder.join(digest);
        if !place.exists() {
            whole::write(&place, &bytes)?;
        }
    }
    Ok(())
}
