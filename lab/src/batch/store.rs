//! The results of a study as a file of JSON lines: a header, then one line for each run, in the order of their indices.
//!
//! Lines are appended as they come. What a kill has torn is the last line only; it is cut off when the study goes on.

use crate::batch::StudyHeader;
use monorig_sim::config::file::regular;
use monorig_sim::error::{Error, InputError};
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{BufRead, BufReader, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// A part of a study's runs: those whose index leaves the remainder `part - 1` when divided by `of`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// Which part, from 1.
    pub part: u64,
    /// Of how many.
    pub of: u64,
}

impl Shard {
    /// All runs.
    pub const WHOLE: Self = Self { part: 1, of: 1 };

    /// The index of its run number `n`, from 0.
    pub fn index(self, n: u64) -> u64 {
        n * self.of + (self.part - 1)
    }

    /// How many of a study's runs it has.
    pub fn runs(self, all: u64) -> u64 {
        (all + self.of - self.part) / self.of
    }
}

/// An open file of results; no other process can open it as one.
#[derive(Debug)]
pub struct ResultStore {
    path: PathBuf,
    file: File,
    done: u64,
}

/// What every line of results begins with.
#[derive(Deserialize)]
struct IndexField {
    index: u64,
}

/// The index of the run of a line; none if the line is not a result.
pub(super) fn index_of(line: &[u8]) -> Option<u64> {
    let start: IndexField = serde_json::from_slice(line).ok()?;
    Some(start.index)
}

impl ResultStore {
    /// Open the results of a study to go on with them, or begin them. `header` (one line, without its end) says which study it
    /// is: a file with another header is refused and left as it is.
    pub fn open(path: &Path, header: &str, shard: Shard) -> Result<Self, Error> {
        let failed = |source| Error::Io {
            path: path.into(),
            source,
        };
        if path.exists() {
            regular(path)?;
        }
        let mut options = OpenOptions::new();
        options.read(true).write(true).create(true).truncate(false);
        let file = options.open(path).map_err(failed)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(wrong(
                    path,
                    None,
                    "another monorig is writing these results",
                    "wait for it, or name another folder with --out",
                ));
            }
            Err(TryLockError::Error(e)) => return Err(failed(e)),
        }
        let (done, end) = whole_lines(path, &file, header, shard)?;
        let mut store = Self {
            path: path.into(),
            file,
            done,
        };
        store.file.set_len(end).map_err(failed)?;
        store.file.seek(SeekFrom::Start(end)).map_err(failed)?;
        if end == 0 {
            store.write(header)?;
        }
        Ok(store)
    }

    /// How many results there are.
    pub fn done(&self) -> u64 {
        self.done
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Append a result (one line, without its end).
    pub fn append(&mut self, line: &str) -> Result<(), Error> {
        self.write(line)?;
        self.done += 1;
        Ok(())
    }

    fn write(&mut self, line: &str) -> Result<(), Error> {
        self.file
            .write_all(format!("{line}\n").as_bytes())
            .map_err(|source| Error::Io {
                path: self.path.clone(),
                source,
            })
    }
}

/// How many results are whole, and where they end.
fn whole_lines(path: &Path, file: &File, header: &str, shard: Shard) -> Result<(u64, u64), Error> {
    let mut reader = BufReader::new(file);
    let (mut end, mut lines, mut line) = (0, 0, Vec::new());
    loop {
        line.clear();
        let read = reader
            .read_until(b'\n', &mut line)
            .map_err(|source| Error::Io {
                path: path.into(),
                source,
            })?;
        let torn = line.pop_if(|last| *last == b'\n').is_none();
        let fits = match lines {
            0 if torn => header.as_bytes().starts_with(&line),
            0 => line == header.as_bytes(),
            _ if torn => true,
            n => index_of(&line) == Some(shard.index(n - 1)),
        };
        if !fits && lines == 0 {
            return Err(wrong(
                path,
                Some(1),
                format!(
                    "these results were made from something else: {}",
                    what_differs(&line, header)
                ),
                "name another folder with --out, or remove this file to begin anew",
            ));
        }
        if !fits {
            return Err(wrong(
                path,
                Some(lines + 1),
                format!("this is not the result of run {}", shard.index(lines - 1)),
                "a file that only monorig has written to; remove it to begin anew",
            ));
        }
        if torn {
            return Ok((lines.saturating_sub(1), end));
        }
        end += read as u64;
        lines += 1;
    }
}

/// What differs between the header that was found and the one that is wanted.
fn what_differs(found: &[u8], header: &str) -> String {
    let found = serde_json::from_slice::<StudyHeader>(found);
    match (found, serde_json::from_str::<StudyHeader>(header)) {
        (Ok(found), Ok(wanted)) => found.differs(&wanted).unwrap_or_default(),
        _ => "its first line is not that of a study of this version of monorig".into(),
    }
}

fn wrong(path: &Path, line: Option<u64>, message: impl Into<String>, help: &str) -> Error {
    InputError {
        file: path.into(),
        line: line.map(|l| l as usize),
        column: line.map(|_| 1),
        key: String::new(),
        message: message.into(),
        help: help.into(),
    }
    .into()
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = r#"{"study":"a","hash":"1"}"#;

    fn line(i: u64) -> String {
        format!(r#"{{"index":{i},"seed":{}}}"#, 7 * i)
    }

    fn fill(path: &Path, shard: Shard, to: u64) -> Result<(), Error> {
        let mut store = ResultStore::open(path, HEADER, shard)?;
        for n in store.done()..to {
            store.append(&line(shard.index(n)))?;
        }
        Ok(())
    }

    /// Cut off anywhere, it goes on to the same bytes.
    #[test]
    fn torn_at_every_byte_it_comes_to_the_same_end() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("results.jsonl");
        let shard = Shard { part: 2, of: 3 };
        fill(&path, shard, 5).unwrap();
        let whole = std::fs::read(&path).unwrap();
        for cut in 0..whole.len() {
            std::fs::write(&path, &whole[..cut]).unwrap();
            fill(&path, shard, 5).unwrap();
            assert_eq!(std::fs::read(&path).unwrap(), whole, "cut at {cut}");
        }
    }

    #[test]
    fn other_studies_and_foreign_lines_are_refused_and_left_alone() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("results.jsonl");
        for other in [
            "{\"study\":\"b\"}\n".to_owned(),
            format!("{HEADER}\n{}\n{}\n", line(0), line(2)),
            format!("{HEADER}\nnonsense\n"),
            "not ours".to_owned(),
        ] {
            std::fs::write(&path, &other).unwrap();
            assert!(matches!(fill(&path, Shard::WHOLE, 5), Err(Error::Input(_))));
            assert_eq!(std::fs::read_to_string(&path).unwrap(), other);
        }
    }

    #[test]
    fn two_at_a_time_are_one_too_many() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("results.jsonl");
        let _first = ResultStore::open(&path, HEADER, Shard::WHOLE).unwrap();
        let second = ResultStore::open(&path, HEADER, Shard::WHOLE);
        assert!(second.unwrap_err().to_string().contains("another monorig"));
    }

    #[test]
    fn shards_share_all_runs() {
        for (all, of) in [(10, 3), (3, 5), (7, 1), (0, 2)] {
            let mut seen: Vec<u64> = Vec::new();
            for part in 1..=of {
                let shard = Shard { part, of };
                seen.extend((0..shard.runs(all)).map(|n| shard.index(n)));
            }
            seen.sort_unstable();
            assert_eq!(seen, (0..all).collect::<Vec<_>>());
        }
    }
}
