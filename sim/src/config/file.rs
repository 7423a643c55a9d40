//! Reading monorig's YAML files: one place that turns whatever is wrong into file, line, column, key, plain words and
//! help.
//!
//! A file is read in two steps: text → tree (syntax, keys given twice), then tree → checked type (unknown and missing
//! keys, wrong types, numbers out of range). `--set` changes the tree in between. What is found wrong later, when
//! several files meet, is reported with [`input_error`], which looks up the line of a key path.

mod error_messages;
mod key_path;
pub(crate) mod limits;
mod locate;
mod ranges;
mod set;
mod sets;
mod suggest;

pub use sets::Sets;
pub use suggest::{nearest, suggestion};

use crate::config::input_files::{InputFiles, note_input};
use crate::error::{DataError, Error, wrong};
use key_path::{join, with_key};
use locate::Target;
use serde::de::DeserializeOwned;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Reads an input file as text. An error names what is there instead.
pub fn read_text(path: &Path) -> Result<String, Error> {
    text(path, &read_bytes(path)?)
}

/// Reads an input file. An error names what is there instead. Within [`InputFiles::during`] it is read from disk once.
pub fn read_bytes(path: &Path) -> Result<Arc<[u8]>, Error> {
    read_input(path, limits::MAX_FILE_BYTES)
}

/// Reads a shared library or an FMU, which may be larger than other input files.
pub fn read_library(path: &Path) -> Result<Arc<[u8]>, Error> {
    read_input(path, limits::MAX_LIBRARY_BYTES)
}

fn read_input(path: &Path, most: u64) -> Result<Arc<[u8]>, Error> {
    let from_disk = || bounded(path, most).map(Arc::from);
    match InputFiles::current() {
        Some(files) => files.get(path, from_disk),
        None => from_disk(),
    }
}

/// Reads a result that monorig has written, as text. An error names what is there instead.
pub fn read_result(path: &Path) -> Result<String, Error> {
    text(path, &bounded(path, limits::MAX_RESULT_BYTES)?)
}

/// Reads a page or a recording of monorig, which may be larger than other results. An error names what is there
/// instead.
pub fn read_large(path: &Path) -> Result<Vec<u8>, Error> {
    bounded(path, limits::MAX_LARGE_BYTES)
}

/// Refuses everything but a regular file: opening a pipe would wait for its writer.
pub fn regular(path: &Path) -> Result<std::fs::Metadata, Error> {
    let metadata = match std::fs::metadata(path) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            let help = suggest::beside(path);
            return Err(wrong(path, None, "this file does not exist", help));
        }
        other => other.map_err(Error::at(path))?,
    };
    if metadata.is_dir() {
        let message = "this is a folder, not a file";
        return Err(wrong(path, None, message, "name a file in this folder"));
    }
    if !metadata.is_file() {
        let message = "this is not a regular file";
        return Err(wrong(path, None, message, "copy its contents into a file"));
    }
    note_input(path);
    Ok(metadata)
}

/// Bytes of a regular file, up to a largest size.
fn bounded(path: &Path, most: u64) -> Result<Vec<u8>, Error> {
    let length = regular(path)?.len();
    let mut bytes = Vec::new();
    if length <= most {
        // a file may grow while it is read
        let file = std::fs::File::open(path);
        file.and_then(|file| file.take(most + 1).read_to_end(&mut bytes))
            .map_err(Error::at(path))?;
    }
    if length > most || bytes.len() as u64 > most {
        return Err(wrong(
            path,
            None,
            format!(
                "this file has {} MB, far more than any file of monorig",
                length.max(most + 1).div_ceil(1 << 20)
            ),
            format!("at most {} MB are read", most >> 20),
        ));
    }
    Ok(bytes)
}

fn text(path: &Path, bytes: &[u8]) -> Result<String, Error> {
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let good = &bytes[..e.valid_up_to()];
        let start = good.iter().rposition(|b| *b == b'\n').map_or(0, |i| i + 1);
        let line = 1 + good.iter().filter(|b| **b == b'\n').count();
        let column = 1 + String::from_utf8_lossy(&good[start..]).chars().count();
        let help = "save the file as UTF-8; if this is not a text file, name another file";
        let message = "this is not text in UTF-8";
        Error::input(path, Some((line, column)), "", message, help)
    })?;
    Ok(text.to_owned())
}

/// Checks that a file that another file names exists. The error is message and help, with the nearest name.
pub fn exists(path: &Path) -> Result<(), (String, String)> {
    if InputFiles::current().is_some_and(|files| files.contains(path)) {
        return Ok(());
    }
    let name = path.display();
    match std::fs::metadata(path) {
        Ok(there) if there.is_dir() => Err((
            format!("{name} is a folder, not a file"),
            "name a file in this folder".into(),
        )),
        Ok(_) => Ok(()),
        Err(e) if not_found(&e) && std::fs::read_link(path).is_ok() => Err((
            format!("{name} is a link to a missing file"),
            "repair the link, or name another file".into(),
        )),
        Err(e) if not_found(&e) => Err((
            format!("the file {name} does not exist"),
            format!(
                "{} (a name in a file is relative to the folder of this file)",
                suggest::beside(path)
            ),
        )),
        Err(e) => Err((
            format!("{name} cannot be read: {e}"),
            "make it readable, or name another file".into(),
        )),
    }
}

fn not_found(e: &std::io::Error) -> bool {
    e.kind() == std::io::ErrorKind::NotFound
}

/// The file that `key` of `file` names, relative to the folder of `file`. It must be there.
pub fn named(file: &Path, key: &str, name: &str) -> Result<PathBuf, Error> {
    let found = file.parent().unwrap_or(Path::new("")).join(name);
    match exists(&found) {
        Ok(()) => Ok(found),
        Err((message, help)) => Err(input_error(file, key, message, help)),
    }
}

/// Returns the name of the file without its extension. Results go into a folder of this name, so it must be one.
pub fn name_of(path: &Path) -> Result<String, Error> {
    let stem = path.file_stem().unwrap_or_default();
    let name = stem.to_string_lossy().into_owned();
    match name.chars().all(|c| c == '.') {
        false => Ok(name),
        true => Err(wrong(
            path,
            None,
            "this name cannot be the name of a folder for results",
            "use a file name with a letter",
        )),
    }
}

/// Read a YAML file into a checked type.
pub(crate) fn read_yaml<T: DeserializeOwned>(path: &Path) -> Result<T, Error> {
    Document::read(path)?.parse()
}

/// Reads a YAML file with changes.
pub(crate) fn read_yaml_with<T: DeserializeOwned>(path: &Path, sets: &Sets) -> Result<T, Error> {
    let mut document = Document::read(path)?;
    document.apply(sets)?;
    document.parse()
}

/// Adds the changes of `--set` to an error found later in a file: the line in the file does not show them.
pub(crate) fn with_sets(e: Error, sets: &Sets) -> Error {
    match (e, sets.all_written()) {
        (Error::Input(mut e), Some(all)) if !e.message.contains(&all) => {
            e.message += &format!(" (read with {all})");
            Error::Input(e)
        }
        (e, _) => e,
    }
}

/// An error found after parsing, at a key of a file such as `vertical[2].radius_m`; line and column are looked up.
pub fn input_error(
    file: &Path,
    key: impl Into<String>,
    message: impl Into<String>,
    help: impl Into<String>,
) -> Error {
    let key = key.into();
    let place = read_text(file)
        .ok()
        .and_then(|text| locate::locate(&text, &key, Target::Value));
    Error::input(file, place, key, message, help)
}

impl DataError {
    /// The error with the file that the data came from; line and column of the key are looked up in it.
    pub(crate) fn in_file(self, file: &Path) -> Error {
        input_error(file, self.key, self.message, self.help)
    }
}

/// A YAML file as a tree, with its text for looking up places, and the changes of `--set`.
#[derive(Clone, Debug, Default)]
pub struct Document {
    path: PathBuf,
    text: String,
    tree: serde_yaml::Value,
    sets: Sets,
}

impl Document {
    /// Read a file: it must be one YAML document, a mapping, without a key given twice.
    pub fn read(path: &Path) -> Result<Self, Error> {
        Self::of(path, read_text(path)?)
    }

    /// Makes a document from a text, as if a file with this path had this text.
    pub fn of(path: &Path, text: String) -> Result<Self, Error> {
        let mut document = Self {
            path: path.into(),
            text,
            ..Self::default()
        };
        limits::yaml(&document.text).map_err(|over| document.over(over))?;
        let de = serde_yaml::Deserializer::from_str(&document.text);
        match serde_path_to_error::deserialize::<_, serde_yaml::Value>(de) {
            Ok(serde_yaml::Value::Null) => Err(document.error(
                "",
                "this file is empty",
                "the first line must be `version: 1`; see `monorig check --schema`",
            )),
            Ok(tree @ serde_yaml::Value::Mapping(_)) => {
                if let Some((key, tag)) = tagged(&tree, "") {
                    let message = format!("the tag `{tag}` has no meaning in files of monorig");
                    return Err(document.error(
                        key,
                        message,
                        "remove the tag, or put the text in quotes",
                    ));
                }
                document.tree = tree;
                Ok(document)
            }
            Ok(_) => Err(document.error(
                "",
                "expected a mapping (lines of `key: value`)",
                "the first line must be `version: 1`",
            )),
            Err(e) => Err(document.syntax_error(&e)),
        }
    }

    /// Change values, as `--set path=value` does; a value is YAML. Missing mappings on the way are made.
    pub fn apply(&mut self, sets: &Sets) -> Result<(), Error> {
        for (path, value) in sets.iter() {
            set::set(&mut self.tree, path, value).map_err(|(message, help)| {
                let message = format!("{}: {message}", sets.written(path, value));
                Error::input(&self.path, None, path, message, help)
            })?;
        }
        self.sets = sets.clone();
        Ok(())
    }

    /// The tree as a checked type.
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T, Error> {
        if let Some((key, message, help)) = ranges::wrong(&self.tree) {
            return Err(self.error(key, message, help));
        }
        serde_path_to_error::deserialize(&self.tree).map_err(|e| {
            let path = match e.path().to_string() {
                p if p == "." => String::new(),
                p => p,
            };
            let told = error_messages::plain(&e.inner().to_string());
            let (key, target) = match &told.unknown_key {
                Some(unknown) => (with_key(&path, unknown), Target::Key),
                None => (path, Target::Value),
            };
            self.error_at(key, target, told.message, told.help)
        })
    }

    /// An error at a key of this file.
    pub fn error(
        &self,
        key: impl Into<String>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Error {
        self.error_at(key.into(), Target::Value, message.into(), help.into())
    }

    /// The keys at the top of the file.
    pub fn keys(&self) -> Vec<String> {
        let top = self.tree.as_mapping().into_iter().flatten();
        top.filter_map(|(key, _)| key.as_str().map(str::to_owned))
            .collect()
    }

    /// Returns true if a text, read as this kind of file, has the same content.
    pub fn is_of(&self, text: &str) -> bool {
        serde_yaml::from_str::<serde_yaml::Value>(text).is_ok_and(|tree| tree == self.tree)
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    fn error_at(&self, key: String, target: Target, message: String, help: String) -> Error {
        let by_set = self.sets.iter().filter(|(path, _)| {
            let path = path.strip_suffix(set::APPEND).unwrap_or(path);
            key.strip_prefix(path)
                .is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
        });
        let by_set = by_set.last();
        let place = match by_set {
            Some(_) => None,
            None => locate::locate(&self.text, &key, target),
        };
        let message = match by_set {
            Some((path, value)) => {
                format!("{message} (given as {})", self.sets.written(path, value))
            }
            None => message,
        };
        Error::input(&self.path, place, key, message, help)
    }

    /// Makes the error of a file that is larger than allowed.
    fn over(&self, over: limits::Over) -> Error {
        Error::input(&self.path, over.place, "", over.message, over.help)
    }

    fn syntax_error(&self, e: &serde_path_to_error::Error<serde_yaml::Error>) -> Error {
        let text = e.inner().to_string();
        if let Some(twice) = error_messages::key_given_twice(&text) {
            let parent = e.path().to_string();
            let key = with_key(if parent == "." { "" } else { &parent }, &twice);
            let message = format!("the key `{twice}` is given twice");
            return self.error_at(
                key,
                Target::SecondKey,
                message,
                "keep only one of the two".into(),
            );
        }
        let place = e.inner().location().map(|l| (l.line(), l.column()));
        let line_at = |number: usize| self.text.lines().nth(number.saturating_sub(1));
        let (number, column) = place.unwrap_or_default();
        let line = line_at(number).unwrap_or_default();
        // the reader notices an unfinished line at the next one
        for number in [number, number.saturating_sub(1)] {
            let text = line_at(number).unwrap_or_default().trim_start_matches(' ');
            if let Some(over) = limits::taken_for_yaml(text) {
                let place = Some((number, column));
                return self.over(limits::Over { place, ..over });
            }
        }
        let told = error_messages::syntax(&text, line);
        Error::input(&self.path, place, "", told.message, told.help)
    }
}

/// Key path and tag of the first value with a YAML tag (`!word`): the reader would drop tags in silence.
fn tagged(tree: &serde_yaml::Value, path: &str) -> Option<(String, String)> {
    use serde_yaml::Value;
    match tree {
        Value::Tagged(value) => Some((path.to_owned(), value.tag.to_string())),
        Value::Sequence(list) => (0..)
            .zip(list)
            .find_map(|(i, item)| tagged(item, &format!("{path}[{i}]"))),
        Value::Mapping(map) => map.iter().find_map(|(key, value)| {
            tagged(key, path).or_else(|| tagged(value, &join(path, key.as_str().unwrap_or("?"))))
        }),
        _ => None,
    }
}

#[cfg(test)]
mod tests;
