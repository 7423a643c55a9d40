//! The lines of a file of results, one at a time, each of bounded length.

use monorig_sim::config::file::regular;
use monorig_sim::error::{Error, wrong};
use monorig_sim::lines::read_line;
use std::fs::File;
use std::io::{BufReader, ErrorKind};
use std::path::{Path, PathBuf};

/// Largest length of a line, bytes: lines of results are much shorter.
const MAX_LINE_BYTES: u64 = 16 << 20;

/// A line without its end.
pub(crate) struct RawLine {
    pub(crate) bytes: Vec<u8>,
    /// It has no end: the file stops within it.
    pub(crate) torn: bool,
}

/// Reads lines. One that is longer than any of ours is an error.
pub(crate) struct Lines {
    path: PathBuf,
    file: BufReader<File>,
    number: usize,
    whole_bytes: u64,
}

impl Lines {
    /// Opens a regular file.
    pub(crate) fn open(path: &Path) -> Result<Self, Error> {
        regular(path)?;
        let file = File::open(path).map_err(Error::at(path))?;
        Ok(Self::of(path, file))
    }

    /// Reads an open file. `path` stands in error messages.
    pub(crate) fn of(path: &Path, file: File) -> Self {
        Self {
            path: path.into(),
            file: BufReader::new(file),
            number: 0,
            whole_bytes: 0,
        }
    }

    /// Number of bytes of complete lines that were read.
    pub(crate) fn whole_bytes(&self) -> u64 {
        self.whole_bytes
    }

    /// The next line; `None` at the end of the file.
    pub(crate) fn read(&mut self) -> Result<Option<RawLine>, Error> {
        self.number += 1;
        let mut bytes = Vec::new();
        match read_line(&mut self.file, MAX_LINE_BYTES, &mut bytes) {
            Ok(true) => {}
            Ok(false) => return Ok(None),
            Err(e) if e.kind() == ErrorKind::InvalidData => {
                let help = "use a file that only monorig has written";
                return Err(self.wrong("this line is too long for a result", help));
            }
            Err(e) => return Err(Error::at(&self.path)(e)),
        }
        let length = bytes.len() as u64;
        let torn = bytes.pop_if(|last| *last == b'\n').is_none();
        self.whole_bytes += if torn { 0 } else { length };
        Ok(Some(RawLine { bytes, torn }))
    }

    /// Makes an error in the line that was read last.
    pub(crate) fn wrong(&self, message: impl Into<String>, help: impl Into<String>) -> Error {
        wrong(&self.path, Some(self.number), message, help)
    }
}
