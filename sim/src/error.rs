//! The one error type of this crate.

use std::path::{Path, PathBuf};

/// Error of reading files, simulating or recording.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file has a value that cannot be used.
    #[error(transparent)]
    Input(#[from] Box<InputError>),
    /// The operating system refused to read or write.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The error of the system.
        source: std::io::Error,
    },
    /// The simulation left its range of validity.
    #[error("the run broke down at t = {t_s:.3} s: {what}")]
    Broken {
        /// Simulated time, s.
        t_s: f64,
        /// The observation.
        what: String,
    },
    /// An estimator cannot go on.
    #[error("the estimator {name} broke down at t = {t_s:.3} s{}: {what}", of_seed(*seed))]
    Estimator {
        /// Name in the scenario.
        name: String,
        /// Seed of the run, if the run has a seed.
        seed: Option<u64>,
        /// Simulated time, s.
        t_s: f64,
        /// Reason of the error.
        what: String,
    },
    /// The controller cannot go on.
    #[error("the controller broke down at t = {t_s:.3} s, seed {seed}: {what}")]
    Controller {
        /// Seed of the run.
        seed: u64,
        /// Simulated time, s.
        t_s: f64,
        /// Reason of the error.
        what: String,
    },
}

impl Error {
    /// Makes errors of the operating system about this file or folder.
    pub fn at(path: &Path) -> impl Fn(std::io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io {
            path: path.clone(),
            source,
        }
    }

    /// Makes an error of an input: line and column, where they are known, and the key, empty for the file as a whole.
    pub fn input(
        file: &Path,
        place: Option<(usize, usize)>,
        key: impl Into<String>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Self {
        Self::Input(Box::new(InputError {
            file: file.into(),
            line: place.map(|p| p.0),
            column: place.map(|p| p.1),
            key: key.into(),
            message: message.into(),
            help: help.into(),
        }))
    }
}

fn of_seed(seed: Option<u64>) -> String {
    seed.map_or_else(String::new, |seed| format!(", seed {seed}"))
}

/// Makes an error in a line of a file, or in the whole of it: what is wrong, and what would be right.
pub fn wrong(
    file: &Path,
    line: Option<usize>,
    message: impl Into<String>,
    help: impl Into<String>,
) -> Error {
    Error::input(file, line.map(|line| (line, 1)), "", message, help)
}

/// A mistake in an input: its place, the message and the remedy.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{place}{message}\n  help: {help}", place = self.place())]
pub struct InputError {
    /// The file.
    pub file: PathBuf,
    /// Line, from 1, if known.
    pub line: Option<usize>,
    /// Column, from 1, if known.
    pub column: Option<usize>,
    /// Path of the key inside the file, such as `vertical[2].radius_m`; empty for the file as a whole.
    pub key: String,
    /// The mistake.
    pub message: String,
    /// The remedy.
    pub help: String,
}

impl InputError {
    /// The place followed by a colon; empty without a place.
    fn place(&self) -> String {
        let place = self.file_and_key();
        if place.is_empty() {
            place
        } else {
            place + ": "
        }
    }

    fn file_and_key(&self) -> String {
        let mut s = self.file.display().to_string();
        if let (Some(l), Some(c)) = (self.line, self.column) {
            s += &format!(":{l}:{c}");
        }
        match (s.is_empty(), self.key.is_empty()) {
            (true, _) => self.key.clone(),
            (false, true) => s,
            (false, false) => format!("{s}: {}", self.key),
        }
    }
}

/// A value from which a part of the simulation cannot be built. The reader of the value adds its file
/// ([`DataError::in_file`]).
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{key}: {message}\n  help: {help}")]
pub struct DataError {
    /// Path of the value, such as `gyro.sampling.rate_hz`; empty for the data as a whole.
    pub key: String,
    /// The mistake.
    pub message: String,
    /// The remedy.
    pub help: String,
}

impl DataError {
    /// The value at `key` is wrong.
    pub fn new(
        key: impl Into<String>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Self {
        Self {
            key: key.into(),
            message: message.into(),
            help: help.into(),
        }
    }

    /// Moves the error below the key `parent` of a larger whole: `key` becomes `parent.key`.
    pub(crate) fn under(self, parent: &str) -> Self {
        let key = match self.key.is_empty() {
            true => parent.to_owned(),
            false => format!("{parent}.{}", self.key),
        };
        Self { key, ..self }
    }
}

/// Converts an error of data without a file, as in a simulation built in code.
impl From<DataError> for Error {
    fn from(e: DataError) -> Self {
        Error::input(Path::new(""), None, e.key, e.message, e.help)
    }
}
