//! The lines of a file of results, one at a time, each of bounded length.

use monorig_sim::config::file::regular;
use monorig_sim::error::{Error, InputError};
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// No line of results comes near this length, bytes.
const MAX_LINE_BYTES: u64 = 16 << 20;

/// A line without its end.
pub(crate) struct RawLine {
    pub(crate) bytes: Vec<u8>,
    /// It has no end: the file stops within it.
    pub(crate) torn: bool,
}

/// Reads lines, as text without their ends. A line that is no text, or longer than any of ours, is an error.
pub struct Lines {
    path: PathBuf,
    file: BufReader<File>,
    number: usize,
}

impl Lines {
    /// Opens a regular file.
    pub fn open(path: &Path) -> Result<Self, Error> {
        regular(path)?;
        let file = File::open(path).map_err(|source| Error::Io {
            path: path.into(),
            source,
        })?;
        Ok(Self::of(path, file))
    }

    /// Reads an open file. `path` stands in error messages.
    pub(crate) fn of(path: &Path, file: File) -> Self {
        Self {
            path: path.into(),
            file: BufReader::new(file),
            number: 0,
        }
    }

    /// Number of the line that was read last, from 1.
    pub(crate) fn number(&self) -> usize {
        self.number
    }

    /// The next line as bytes; `None` at the end of the file.
    pub(crate) fn read(&mut self) -> Result<Option<RawLine>, Error> {
        self.number += 1;
        let mut bytes = Vec::new();
        let mut bounded = self.file.by_ref().take(MAX_LINE_BYTES + 1);
        let read = bounded.read_until(b'\n', &mut bytes);
        read.map_err(|source| Error::Io {
            path: self.path.clone(),
            source,
        })?;
        if bytes.len() as u64 > MAX_LINE_BYTES {
            return Err(self.wrong("this line is longer than any result"));
        }
        if bytes.is_empty() {
            return Ok(None);
        }
        let torn = bytes.pop_if(|last| *last == b'\n').is_none();
        Ok(Some(RawLine { bytes, torn }))
    }

    fn wrong(&self, message: &str) -> Error {
        let help = "a file that only monorig has written to";
        wrong(&self.path, Some(self.number), message, help)
    }
}

impl Iterator for Lines {
    type Item = Result<String, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        let line = self.read().transpose()?;
        let text = |line: RawLine| {
            String::from_utf8(line.bytes).map_err(|_| self.wrong("this line is not text in UTF-8"))
        };
        Some(line.and_then(text))
    }
}

/// An error in a line of a file.
pub(crate) fn wrong(
    path: &Path,
    line: Option<usize>,
    message: impl Into<String>,
    help: impl Into<String>,
) -> Error {
    InputError {
        file: path.into(),
        line,
        column: line.map(|_| 1),
        key: String::new(),
        message: message.into(),
        help: help.into(),
    }
    .into()
}
