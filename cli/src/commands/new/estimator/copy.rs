//! An estimator of your own: a copy of an example in monorig's sources, with its name and its path to the sources
//! changed.

use crate::files::report::link;
use crate::files::share;
use crate::ui::errors::CliError;
use monorig_sim::config::file::read_text;
use monorig_sim::error::Error;
use monorig_sim::record::whole;
use std::path::{Path, PathBuf};

/// Example that the command copies.
pub(in crate::commands::new) struct Example {
    /// Folder of the example in the sources of monorig.
    pub folder: &'static str,
    /// Files of the example that are copied.
    pub files: &'static [&'static str],
    /// The file with the estimator.
    pub estimator: &'static str,
    /// Shell command to run next in the new folder; `{way}` is the path to monorig's sources, `{install}` a command for
    /// Python.
    pub next: &'static str,
}

impl Example {
    /// Returns the path from the example to the sources of monorig, as its files write it.
    fn way(&self) -> String {
        "../".repeat(self.folder.split('/').count())
    }

    /// Returns true if the example is a crate, which has a name and a lock file.
    fn is_crate(&self) -> bool {
        self.files.contains(&LOCK)
    }
}

/// Name of the crate that is copied.
const CRATE_NAME: &str = "own_estimator";
const LOCK: &str = "Cargo.lock";
/// Words for a new crate where there are no sources of ours.
const RELEASED: &str = "its Cargo.toml names crates of crates.io; until they are there, name a checkout with --monorig\n";
/// Between two packages of a lock file.
const PACKAGE: &str = "\n[[package]]\n";

/// Copies the whole example or nothing, and returns the message for the user.
pub(super) fn make(
    example: &Example,
    folder: &Path,
    monorig: Option<&Path>,
) -> Result<String, CliError> {
    let name = match example.is_crate() {
        true => crate_name(folder)?,
        false => last_part(folder),
    };
    if folder.symlink_metadata().is_ok() {
        let message = format!("{} exists already", folder.display());
        return Err(CliError::refused(message, "name a new folder"));
    }
    let here = std::env::current_dir().map_err(|e| failed(Path::new("."), e))?;
    let folder = here.join(folder);
    let parent = folder.parent().unwrap_or(&here);
    let sources = sources((example.folder, example.files), monorig, [&here, parent])?;
    std::fs::create_dir_all(parent).map_err(|e| failed(parent, e))?;
    let parent = parent.canonicalize().map_err(|e| failed(parent, e))?;
    let way = way(&parent.join(&name), &sources)?;
    let unfinished = parent.join(format!(".{name}-{}", whole::unique()));
    let made = fill(example, &unfinished, &sources, &name, &way)
        .and_then(|()| std::fs::rename(&unfinished, &folder).map_err(|e| failed(&folder, e)));
    if let Err(e) = made {
        // what is left of it is of no use; there is no one to return a second error to
        let _ = std::fs::remove_dir_all(&unfinished);
        return Err(e);
    }
    let at = folder.strip_prefix(&here).unwrap_or(&folder).display();
    // what comes with an installed program is installed itself
    let install = "pip install {way}interfaces/python && ";
    let next = example.next.replace("{install}", install);
    let (released, next) = match has_crates(&sources) {
        true => ("", next.replace("{way}", &way)),
        false if example.is_crate() => (RELEASED, "cargo test --release".to_owned()),
        false => ("", example.next.replace("{install}", "")),
    };
    Ok(format!(
        "made {at}: {} files; the estimator `mine` is in {}\n\
         {released}next: cd {at} && {next}\n",
        example.files.len(),
        example.estimator,
    ))
}

/// Last part of a path to a folder.
fn last_part(folder: &Path) -> String {
    let name = folder.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// Name of the crate: the name of the folder.
fn crate_name(folder: &Path) -> Result<String, CliError> {
    let name = last_part(folder);
    let mut letters = name.chars();
    let first = letters.next().is_some_and(|c| c.is_ascii_alphabetic());
    if first && letters.all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-') {
        return Ok(name);
    }
    Err(CliError::refused(
        format!("`{name}` is not a valid name of a crate"),
        "name a folder that begins with a letter and has letters, digits, `_` and `-` only",
    ))
}

/// Folder of monorig's sources: the given folder, the nearest at or above `starts`, or the folder that comes with the
/// program.
pub(in crate::commands::new) fn sources(
    (folder, files): (&str, &[&str]),
    given: Option<&Path>,
    starts: [&Path; 2],
) -> Result<PathBuf, CliError> {
    let has = |sources: &Path| {
        let mut files = files.iter();
        files.all(|file| sources.join(folder).join(file).is_file())
    };
    let places = match given {
        Some(folder) => vec![folder.to_owned()],
        None => share::folders(starts),
    };
    let Some(found) = places.iter().find(|p| has(p)) else {
        let message = match given {
            Some(given) => format!("{} has no {folder}", given.display()),
            None => "neither this folder nor a folder above it has the sources of monorig, and no copy of its examples is beside the program".into(),
        };
        let help = "name the folder of monorig's sources with --monorig: the new folder refers to files in it";
        return Err(CliError::refused(message, help));
    };
    found.canonicalize().map_err(|e| failed(found, e))
}

/// Path from a folder to monorig's sources with `/` at its end, in a form for TOML, YAML and a shell.
pub(in crate::commands::new) fn way(from: &Path, sources: &Path) -> Result<String, CliError> {
    let way = link(from, sources);
    match way
        .chars()
        .all(|c| c.is_alphanumeric() || "/._-:~+@".contains(c))
    {
        true => Ok(way),
        false => Err(CliError::refused(
            format!("the path to monorig's sources, `{way}`, cannot be written in every file"),
            "move one of the folders: a path may have letters, digits and / . _ - : ~ + @",
        )),
    }
}

/// True where the crates themselves are, not the examples alone.
fn has_crates(sources: &Path) -> bool {
    sources.join("cli/Cargo.toml").is_file()
}

/// Writes the files of the example with the changes.
fn fill(
    example: &Example,
    folder: &Path,
    sources: &Path,
    name: &str,
    way: &str,
) -> Result<(), CliError> {
    for file in example.files {
        let text = read_text(&sources.join(example.folder).join(file))?;
        let text = match *file {
            LOCK => renamed_lock(&text, name),
            "Cargo.toml" if !has_crates(sources) => {
                let version = concat!("version = \"", env!("CARGO_PKG_VERSION"), "\"");
                let ours = ["estimators", "cli"].map(|of| format!("path = \"../../{of}\""));
                let text = text.replace(&ours[0], version).replace(&ours[1], version);
                text.replace(CRATE_NAME, name)
            }
            _ if example.is_crate() => text.replace(&example.way(), way).replace(CRATE_NAME, name),
            _ => text.replace(&example.way(), way),
        };
        crate::ui::output::write_in(folder, file, &text)?;
    }
    Ok(())
}

/// Lock file with the package of the example renamed and sorted to its new place.
fn renamed_lock(text: &str, name: &str) -> String {
    let name_line = |name: &str| format!("name = \"{name}\"\n");
    let text = text.replacen(&name_line(CRATE_NAME), &name_line(name), 1);
    let mut all: Vec<&str> = text.trim_end().split(PACKAGE).map(str::trim_end).collect();
    let head = all.remove(0);
    all.sort_by_key(|package| package.split('"').nth(1));
    let all: Vec<String> = all.iter().map(|p| format!("{PACKAGE}{p}\n")).collect();
    format!("{head}\n{}", all.concat())
}

fn failed(path: &Path, source: std::io::Error) -> CliError {
    let path = path.into();
    Error::Io { path, source }.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every file of an example that is kept is copied, and no other.
    #[test]
    fn the_list_is_what_the_example_has() {
        use super::super::{C, RUST, SIMULINK};
        for example in [RUST, C, SIMULINK] {
            compare(&example);
        }
    }

    fn compare(listed: &Example) {
        let example = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("..")
            .join(listed.folder);
        let names = |folder: &Path| -> Vec<String> {
            let entries = std::fs::read_dir(folder).unwrap();
            let name = |e: std::fs::DirEntry| e.file_name().into_string().unwrap();
            entries.map(|e| name(e.unwrap())).collect()
        };
        let mut there = names(&example);
        let made = |n: &str| ["target", "runs", "src", "tests"].contains(&n) || n.ends_with(".so");
        there.retain(|n| !made(n));
        for folder in ["src", "tests"] {
            if !listed.is_crate() {
                continue;
            }
            let inside = names(&example.join(folder));
            there.extend(inside.iter().map(|n| format!("{folder}/{n}")));
        }
        there.sort();
        let mut files = listed.files.to_vec();
        files.sort();
        assert_eq!(there, files);
    }

    /// The packages stay in the order of their names, whatever the new one is called.
    #[test]
    fn packages_of_the_lock_stay_in_order() {
        let package = |name: &str| format!("{PACKAGE}name = \"{name}\"\nversion = \"1.0.0\"\n");
        let lock = |names: &[&str]| {
            let all: Vec<String> = names.iter().map(|n| package(n)).collect();
            format!("# made by Cargo\nversion = 4\n{}", all.concat())
        };
        let before = lock(&["a", "m", CRATE_NAME, "z"]);
        assert_eq!(renamed_lock(&before, CRATE_NAME), before);
        for (name, after) in [
            ("A1", ["A1", "a", "m", "z"]),
            ("b", ["a", "b", "m", "z"]),
            ("zz", ["a", "m", "z", "zz"]),
        ] {
            assert_eq!(renamed_lock(&before, name), lock(&after));
        }
    }
}
