//! The lines of a file of results, one at a time, each of bounded length.

use monorig_sim::config::file::regular;
use monorig_sim::error::{Error, InputError};
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// No line of results comes near this length, bytes.
const MAX_LINE_BYTES: u64 = 16 << 20;

/// Reads lines as text, without their ends. A line that is no text, or longer than any of ours, is an error.
pub struct Lines {
    path: PathBuf,
    file: BufReader<File>,
    number: usize,
}

impl Lines {
    /// Of a regular file.
    pub fn open(path: &Path) -> Result<Self, Error> {
        regular(path)?;
        let file = File::open(path).map_err(|source| Error::Io {
            path: path.into(),
            source,
        })?;
        Ok(Self {
            path: path.into(),
            file: BufReader::new(file),
            number: 0,
        })
    }

    /// Number of the line that was read last, from 1.
    pub fn number(&self) -> usize {
        self.number
    }

    fn wrong(&self, message: &str) -> Error {
        InputError {
            file: self.path.clone(),
            line: Some(self.number),
            column: Some(1),
            key: String::new(),
            message: message.into(),
            help: "a file that only monorig has written to".into(),
        }
        .into()
    }
}

impl Iterator for Lines {
    type Item = Result<String, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        self.number += 1;
        let mut line = Vec::new();
        let mut bounded = self.file.by_ref().take(MAX_LINE_BYTES + 1);
        if let Err(source) = bounded.read_until(b'\n', &mut line) {
            let path = self.path.clone();
            return Some(Err(Error::Io { path, source }));
        }
        if line.is_empty() {
            return None;
        }
        if line.len() as u64 > MAX_LINE_BYTES {
            return Some(Err(self.wrong("this line is longer than any result")));
        }
        line.pop_if(|last| *last == b'\n');
        Some(String::from_utf8(line).map_err(|_| self.wrong("this line is not text in UTF-8")))
    }
}
