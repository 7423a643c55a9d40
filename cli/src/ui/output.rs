//! Writing to standard output without panicking when its reader has gone or the disk is full.

use crate::ui::errors::CliError;
use monorig_sim::error::Error;
use std::io::{ErrorKind, Write};
use std::path::Path;

/// Write text to standard output, and see that it has arrived.
pub fn print(text: &str) -> Result<(), CliError> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())
        .and_then(|()| out.flush())
        .map_err(|e| match e.kind() {
            ErrorKind::BrokenPipe => CliError::ReaderGone,
            _ => CliError::Output(e),
        })
}

/// Write a whole file: under a temporary name first, so that no half of it is ever there. Its folder is made if need be.
pub fn write(path: &Path, text: &str) -> Result<(), CliError> {
    let failed = |source| Error::Io {
        path: path.into(),
        source,
    };
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(failed)?;
    }
    let mut partial = path.as_os_str().to_owned();
    partial.push(format!(".partial-{}", std::process::id()));
    std::fs::write(&partial, text)
        .and_then(|()| std::fs::rename(&partial, path))
        .map_err(|e| {
            let _ = std::fs::remove_file(&partial);
            failed(e).into()
        })
}
