//! Writing to standard output without a panic if its reader has ended or the disk is full.

use crate::ui::errors::CliError;
use crate::ui::{colour, interrupt, note, terminal};
use clap::ArgMatches;
use clap::parser::ValueSource;
use monorig_lab::text::spelled_out;
use monorig_sim::config::input_files;
use monorig_sim::error::Error;
use monorig_sim::record::whole;
use std::collections::BTreeSet;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Writes text to standard output, and checks that it was written. Names in the text may come from files, so hidden
/// characters are spelled out.
pub fn print(text: &str) -> Result<(), CliError> {
    arrive(&spelled_out(text))
}

/// Writes verdicts to standard output, in colour if the user wants colour.
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

/// Writes a result for people: to standard output or, if standard output has a result for programs (`programs`), to
/// standard error.
pub fn result(text: &str, programs: &[Option<&Path>]) -> Result<(), CliError> {
    match programs.iter().flatten().any(|path| is_standard(path)) {
        true => note::note(text.trim_end()),
        false => return verdicts(text),
    }
    Ok(())
}

/// Writes a complete file or, for `-`, to standard output. A file is written under a temporary name first, so that it
/// is always complete. A link, a device or an input of the command at this path is an error.
pub fn write(path: &Path, text: &str) -> Result<(), CliError> {
    if is_standard(path) {
        return arrive(text);
    }
    folder_of(path)?;
    Ok(whole::write(path, text.as_bytes())?)
}

/// Writes a complete file in a folder for results, and makes the folders of its path.
pub fn write_in(folder: &Path, name: impl AsRef<Path>, text: &str) -> Result<(), CliError> {
    let path = folder.join(name);
    let parent = path.parent().unwrap_or(folder);
    std::fs::create_dir_all(parent).map_err(Error::at(parent))?;
    write(&path, text)
}

/// Arguments that name a file for results; `OUT` names a file or a folder.
const WRITTEN: [&str; 6] = ["csv", "html", "into", "json", "junit", "markdown"];
const OUT: &str = "out";
/// Arguments that name a folder for results. The command makes this folder; its parent folder must exist.
const FOLDERS: [&str; 3] = [OUT, "folder", "keep_failed"];
/// Files for results that the command line names.
static RESULTS: OnceLock<Vec<PathBuf>> = OnceLock::new();

/// Checks the files for results that the command line names: their folders exist, all differ, and none is an input. The
/// other files on the command line are inputs from now on.
pub fn check(words: &ArgMatches) -> Result<(), CliError> {
    input_files::guard_inputs();
    for folder in FOLDERS {
        let told = words.try_get_one::<PathBuf>(folder).ok().flatten();
        let typed = words.try_contains_id(folder).unwrap_or_default()
            && words.value_source(folder) == Some(ValueSource::CommandLine);
        told.filter(|_| typed)
            .map_or(Ok(()), |path| folder_of(path).map(|_| ()))?;
    }
    let (results, others): (Vec<_>, Vec<_>) = (words.ids().map(clap::Id::as_str))
        .filter(|id| *id != OUT)
        .filter_map(|id| Some((id, words.try_get_many::<PathBuf>(id).ok()??)))
        .partition(|(id, _)| WRITTEN.contains(id));
    let inputs = others.into_iter().flat_map(|(_, paths)| paths);
    inputs
        .filter(|p| p.is_file())
        .for_each(|p| input_files::note_input(p));
    let results: Vec<PathBuf> = results
        .into_iter()
        .flat_map(|(_, paths)| paths.cloned())
        .collect();
    let mut places = BTreeSet::new();
    for path in &results {
        let place = folder_of(path)?.canonicalize().unwrap_or_default();
        if !places.insert((place, path.file_name())) {
            let message = format!("two results would be written to {}", path.display());
            return Err(CliError::refused(message, "give each result its own name"));
        }
        if !is_standard(path) {
            whole::replaceable(path)?;
        }
    }
    let _ = RESULTS.set(results);
    Ok(())
}

/// Begins the work of a command after its inputs are read: it listens for Ctrl-C, and removes older results, so that
/// nobody confuses old and new results.
pub fn begin() -> Result<(), CliError> {
    interrupt::listen();
    RESULTS
        .get()
        .into_iter()
        .flatten()
        .try_for_each(|path| clear(path))
}

/// Folder of a file for results, which must exist: a missing folder may be a typing mistake.
fn folder_of(path: &Path) -> Result<&Path, CliError> {
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    if folder.is_dir() {
        return Ok(folder);
    }
    let message = format!(
        "{}: there is no folder {}",
        path.display(),
        folder.display()
    );
    Err(CliError::refused(
        message,
        "make the folder first, or name another folder",
    ))
}

/// Removes an older file at the path where [`write`] will put a new file. A link, a device or an input at this path is
/// an error.
fn clear(path: &Path) -> Result<(), CliError> {
    if is_standard(path) {
        return Ok(());
    }
    whole::replaceable(path)?;
    match std::fs::remove_file(path) {
        Err(e) if e.kind() != ErrorKind::NotFound => Err(Error::at(path)(e).into()),
        _ => Ok(()),
    }
}
