//! Reading our YAML files: one place that turns a parse error into file, line, column and key.

use crate::error::{Error, InputError};
use serde::de::DeserializeOwned;
use std::path::Path;

/// Read a text file; errors name it.
pub fn read_text(path: &Path) -> Result<String, Error> {
    std::fs::read_to_string(path).map_err(|source| Error::Io {
        path: path.into(),
        source,
    })
}

/// Read a YAML file into a checked type.
pub fn read_yaml<T: DeserializeOwned>(path: &Path) -> Result<T, Error> {
    let text = read_text(path)?;
    let de = serde_yaml::Deserializer::from_str(&text);
    serde_path_to_error::deserialize(de).map_err(|e| {
        let key = e.path().to_string();
        let place = e.inner().location();
        InputError {
            file: path.into(),
            line: place.as_ref().map(|l| l.line()),
            column: place.as_ref().map(|l| l.column()),
            key: if key == "." { String::new() } else { key },
            message: e.inner().to_string(),
            help: String::new(),
        }
        .into()
    })
}

/// An error found after parsing, at a key of a file; line and column are looked up.
pub fn input_error(
    file: &Path,
    key: impl Into<String>,
    message: impl Into<String>,
    help: impl Into<String>,
) -> Error {
    InputError {
        file: file.into(),
        line: None,
        column: None,
        key: key.into(),
        message: message.into(),
        help: help.into(),
    }
    .into()
}

impl From<InputError> for Error {
    fn from(e: InputError) -> Self {
        Error::Input(Box::new(e))
    }
}
