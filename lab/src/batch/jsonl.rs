//! A file of JSON lines that grows: a header, then rows in order.
//!
//! A row is appended as soon as there is one. A kill can tear the last line only. That line is cut off when the file
//! is opened again.

use crate::batch::lines::{Lines, RawLine, wrong};
use monorig_sim::config::file::regular;
use monorig_sim::error::Error;
use monorig_sim::record::whole;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Seek, SeekFrom, Write};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

/// The first line of such a file: rows are only added below an equal one.
pub trait Header: Serialize + DeserializeOwned {
    /// Name of the rows in error messages, such as `results`.
    const ROWS: &'static str;
    /// Advice to begin anew, in error messages.
    const ANEW: &'static str;

    /// Difference between the header of a file (`self`) and that of the rows to add. `None`: they are equal.
    fn differs(&self, here: &Self) -> Option<String>;
}

/// An open file. No other process can open it to add rows.
#[derive(Debug)]
pub struct Jsonl<H> {
    path: PathBuf,
    file: File,
    rows: u64,
    header: PhantomData<fn(&H)>,
}

impl<H: Header> Jsonl<H> {
    /// Opens a file to add rows, or begins it. A file with another header is refused and left as it is. `row` gets
    /// the number (from 0) and the bytes of each whole row, and refuses it with a message.
    pub(crate) fn open(
        path: &Path,
        header: &H,
        mut row: impl FnMut(u64, &[u8]) -> Result<(), String>,
    ) -> Result<Self, Error> {
        let mut store = Self::locked(path)?;
        let wanted = to_line(header);
        let file = store.file.try_clone().map_err(|e| store.failed(e))?;
        let mut lines = Lines::of(path, file);
        let mut end = 0;
        while let Some(RawLine { bytes, torn }) = lines.read()? {
            let line = lines.number();
            let fits = match torn {
                true => wanted.as_bytes().starts_with(&bytes),
                false => bytes == wanted.as_bytes(),
            };
            if line == 1 && !fits {
                let what = what_differs(&bytes, header);
                let message = format!("these {} were made from something else: {what}", H::ROWS);
                let help = format!("name another folder with --out, or {}", H::ANEW);
                return Err(wrong(path, Some(1), message, help));
            }
            if torn {
                break;
            }
            if line > 1 {
                row(store.rows, &bytes).map_err(|message| {
                    let help = format!("a file that only monorig has written to; {}", H::ANEW);
                    wrong(path, Some(line), message, help)
                })?;
                store.rows += 1;
            }
            end += bytes.len() as u64 + 1;
        }
        store.cut(end)?;
        if end == 0 {
            store.write(&wanted)?;
        }
        Ok(store)
    }

    /// Begins a file, in place of an older one.
    pub(crate) fn replace(path: &Path, header: &H) -> Result<Self, Error> {
        whole::replaceable(path)?;
        let mut store = Self::locked(path)?;
        store.cut(0)?;
        store.write(&to_line(header))?;
        Ok(store)
    }

    fn locked(path: &Path) -> Result<Self, Error> {
        if path.exists() {
            regular(path)?;
        }
        let mut options = OpenOptions::new();
        options.read(true).write(true).create(true).truncate(false);
        let failed = |source| Error::Io {
            path: path.into(),
            source,
        };
        let file = options.open(path).map_err(failed)?;
        match file.try_lock() {
            Ok(()) => Ok(Self {
                path: path.into(),
                file,
                rows: 0,
                header: PhantomData,
            }),
            Err(TryLockError::WouldBlock) => Err(wrong(
                path,
                None,
                format!("another monorig is writing these {}", H::ROWS),
                "wait for it, or name another folder with --out",
            )),
            Err(TryLockError::Error(e)) => Err(failed(e)),
        }
    }

    /// Number of rows.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Appends a row.
    pub fn append(&mut self, row: &impl Serialize) -> Result<(), Error> {
        self.write(&to_line(row))?;
        self.rows += 1;
        Ok(())
    }

    /// Leaves the first bytes only, and goes to their end.
    fn cut(&mut self, end: u64) -> Result<(), Error> {
        let cut = self.file.set_len(end);
        let moved = cut.and_then(|()| self.file.seek(SeekFrom::Start(end)));
        moved.map(drop).map_err(|e| self.failed(e))
    }

    fn write(&mut self, line: &str) -> Result<(), Error> {
        let written = self.file.write_all(format!("{line}\n").as_bytes());
        written.map_err(|e| self.failed(e))
    }

    fn failed(&self, source: std::io::Error) -> Error {
        Error::Io {
            path: self.path.clone(),
            source,
        }
    }
}

/// A line of JSON, without its end.
pub(crate) fn to_line(value: &impl Serialize) -> String {
    // Strings and finite numbers: nothing in headers and rows can fail to serialise.
    serde_json::to_string(value).unwrap_or_default()
}

fn what_differs<H: Header>(found: &[u8], wanted: &H) -> String {
    let found = serde_json::from_slice::<H>(found).ok();
    let differs = found.and_then(|found| found.differs(wanted));
    differs
        .unwrap_or_else(|| "its first line is not one that this version of monorig writes".into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Serialize, Deserialize)]
    struct Named {
        study: String,
    }

    impl Header for Named {
        const ROWS: &'static str = "results";
        const ANEW: &'static str = "remove this file to begin anew";

        fn differs(&self, here: &Self) -> Option<String> {
            Some(format!("{} there, {} here", self.study, here.study))
        }
    }

    fn open(path: &Path) -> Result<Jsonl<Named>, Error> {
        let header = Named { study: "ä".into() };
        Jsonl::open(path, &header, |n, line| match line {
            line if line == to_line(&n).as_bytes() => Ok(()),
            _ => Err(format!("this is not row {n}")),
        })
    }

    fn fill(path: &Path) -> Result<(), Error> {
        let mut store = open(path)?;
        for n in store.rows()..5 {
            store.append(&n)?;
        }
        Ok(())
    }

    /// Cut off anywhere, it goes on to the same bytes.
    #[test]
    fn torn_at_every_byte_it_comes_to_the_same_end() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("results.jsonl");
        fill(&path).unwrap();
        let whole = std::fs::read(&path).unwrap();
        for cut in 0..whole.len() {
            std::fs::write(&path, &whole[..cut]).unwrap();
            fill(&path).unwrap();
            assert_eq!(std::fs::read(&path).unwrap(), whole, "cut at {cut}");
        }
    }

    #[test]
    fn other_headers_and_foreign_lines_are_refused_and_left_alone() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("results.jsonl");
        let header = "{\"study\":\"ä\"}\n";
        for other in [
            "{\"study\":\"b\"}\n".to_owned(),
            format!("{header}0\n2\n"),
            format!("{header}nonsense\n"),
            "not ours".to_owned(),
        ] {
            std::fs::write(&path, &other).unwrap();
            assert!(matches!(fill(&path), Err(Error::Input(_))));
            assert_eq!(std::fs::read_to_string(&path).unwrap(), other);
        }
    }

    #[test]
    fn an_older_file_is_replaced() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("results.jsonl");
        std::fs::write(&path, "{\"study\":\"b\"}\n0\n1\n").unwrap();
        let header = Named { study: "ä".into() };
        drop(Jsonl::replace(&path, &header).unwrap());
        assert_eq!(open(&path).unwrap().rows(), 0);
    }

    #[test]
    fn two_at_a_time_are_one_too_many() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("results.jsonl");
        let _first = open(&path).unwrap();
        let second = open(&path).unwrap_err();
        assert!(second.to_string().contains("another monorig"));
    }
}
