//! Writing to standard output without panicking when its reader has gone or the disk is full.

use crate::ui::errors::CliError;
use crate::ui::{colour, note, terminal};
use monorig_lab::text::spelled_out;
use monorig_sim::error::Error;
use monorig_sim::record::whole;
use std::io::{ErrorKind, Write};
use std::path::Path;

/// Write text to standard output, and see that it has arrived. Names in it may come from files, so hidden characters
/// are spelled out.
pub fn print(text: &str) -> Result<(), CliError> {
    arrive(&spelled_out(text))
}

/// Writes verdicts to standard output, in colour where the user has it.
pub fn verdicts(text: &str) -> Result<(), CliError> {
    let text = spelled_out(text);
    match terminal::coloured() {
        true => arrive(&colour::verdicts(&text)),
        false => arrive(&text),
    }
}

fn arrive(text: &str) -> Result<(), CliError> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())
        .and_then(|()| out.flush())
        .map_err(|e| match e.kind() {
            ErrorKind::BrokenPipe => CliError::ReaderGone,
            _ => CliError::Output(e),
        })
}

/// True for the path `-`, which stands for standard output.
pub fn is_standard(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Writes a result for people: to standard output, or, where that has a result for programs (`programs`), to standard
/// error.
pub fn result(text: &str, programs: &[Option<&Path>]) -> Result<(), CliError> {
    match programs.iter().flatten().any(|path| is_standard(path)) {
        true => note::note(text.trim_end()),
        false => return verdicts(text),
    }
    Ok(())
}

/// Writes a whole file, or, as `-`, to standard output. A file is written under a temporary name first, so that no half
/// of it is ever there. Its folder is made if need be. A link or a device in its place is an error.
pub fn write(path: &Path, text: &str) -> Result<(), CliError> {
    if is_standard(path) {
        return arrive(text);
    }
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(Error::at(path))?;
    }
    Ok(whole::write(path, text.as_bytes())?)
}

/// Remove an older file where [`write`] will put a new one. A link or a device in its place is an error.
pub fn clear(path: &Path) -> Result<(), CliError> {
    if is_standard(path) {
        return Ok(());
    }
    whole::replaceable(path)?;
    match std::fs::remove_file(path) {
        Err(e) if e.kind() != ErrorKind::NotFound => Err(Error::at(path)(e).into()),
        _ => Ok(()),
    }
}
