//! The file of a campaign during its runs: it grows by a row as soon as there is one.
//!
//! A kill can tear the last line only. That line is cut off when the file is opened again.

use crate::campaign::lines::{Lines, RawLine};
use crate::campaign::wrong;
use crate::campaign::{Campaign, CampaignRow, Rows};
use monorig_sim::config::file::regular;
use monorig_sim::error::Error;
use monorig_sim::record::whole;
use serde::Serialize;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Seek, SeekFrom, Write};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

/// An open file. No other process can open it to add rows.
#[derive(Debug)]
pub struct Store<R> {
    path: PathBuf,
    file: File,
    rows: u64,
    row: PhantomData<fn(&R)>,
}

impl<R: CampaignRow> Store<R> {
    /// Opens the file of a campaign to add rows, or makes it; `take` gets each existing row. A file of another campaign
    /// is refused and left as it is.
    pub fn resume(
        path: &Path,
        campaign: &Campaign,
        mut take: impl FnMut(R),
    ) -> Result<Self, Error> {
        let mut store = Self::locked(path)?;
        let file = store.file.try_clone().map_err(|e| store.failed(e))?;
        let mut lines = Lines::of(path, file);
        let header = lines.read()?;
        let wanted = to_line(campaign);
        let begun = match &header {
            Some(RawLine { bytes, torn: false }) if *bytes == wanted.as_bytes() => true,
            Some(RawLine { bytes, torn: true }) if wanted.as_bytes().starts_with(bytes) => false,
            None => false,
            Some(RawLine { bytes, .. }) => {
                let found = serde_json::from_slice::<Campaign>(bytes).ok();
                let what = found.and_then(|found| found.differs(campaign));
                let what = what.unwrap_or_else(|| {
                    "this version of monorig does not write such a first line".into()
                });
                let message = format!("these results were made from other inputs: {what}");
                let anew = campaign.kind.anew();
                let help = format!("name another folder with --out, or {anew}");
                return Err(wrong(path, Some(1), message, help));
            }
        };
        if !begun {
            store.cut(0)?;
            store.write(&wanted)?;
            return Ok(store);
        }
        let mut rows = Rows::behind(campaign.clone(), lines)?;
        for row in rows.by_ref() {
            take(row?.1);
        }
        store.rows = rows.read();
        store.cut(rows.whole_bytes())?;
        Ok(store)
    }

    /// Makes a new file, which replaces an older file.
    pub fn replace(path: &Path, campaign: &Campaign) -> Result<Self, Error> {
        whole::replaceable(path)?;
        let mut store = Self::locked(path)?;
        store.cut(0)?;
        store.write(&to_line(campaign))?;
        Ok(store)
    }

    fn locked(path: &Path) -> Result<Self, Error> {
        if path.exists() {
            regular(path)?;
        }
        let mut options = OpenOptions::new();
        options.read(true).write(true).create(true).truncate(false);
        let file = options.open(path).map_err(Error::at(path))?;
        match file.try_lock() {
            Ok(()) => Ok(Self {
                path: path.into(),
                file,
                rows: 0,
                row: PhantomData,
            }),
            Err(TryLockError::WouldBlock) => Err(wrong(
                path,
                None,
                "another monorig process is writing these results",
                "wait for this process, or name another folder with --out",
            )),
            Err(TryLockError::Error(e)) => Err(Error::at(path)(e)),
        }
    }

    /// Number of rows.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// Appends a row.
    pub fn append(&mut self, row: &R) -> Result<(), Error> {
        self.write(&to_line(row))?;
        self.rows += 1;
        Ok(())
    }

    /// Keeps only the first bytes, and goes to their end.
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
        Error::at(&self.path)(source)
    }
}

/// A whole file of a campaign.
pub fn text<R: CampaignRow>(campaign: &Campaign, rows: &[R]) -> String {
    let rows = rows.iter().map(to_line);
    let lines = std::iter::once(to_line(campaign)).chain(rows);
    lines.map(|line| line + "\n").collect()
}

/// A line of JSON, without its end.
pub(super) fn to_line(value: &impl Serialize) -> String {
    // Strings and finite numbers: nothing in headers and rows can fail to serialise.
    serde_json::to_string(value).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::{CampaignKind, RunList};
    use monorig_sim::record::identity::Identity;

    impl CampaignRow for u64 {
        type Plan = ();

        fn plan(_: &Campaign) -> Result<(), String> {
            Ok(())
        }

        fn check(&self, campaign: &Campaign, (): &(), index: u64) -> Result<(), String> {
            campaign.is_run(index, "a", *self).map(drop)
        }
    }

    fn campaign(name: &str) -> Campaign {
        let list = vec![RunList::new("a", 0..5)];
        let identity = Identity::of_program(None);
        Campaign::new(
            CampaignKind::Study,
            name,
            list,
            &identity,
            [].into(),
            ().into(),
        )
    }

    fn open(path: &Path) -> Result<Store<u64>, Error> {
        Store::resume(path, &campaign("ä"), |_| ())
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
        assert_eq!(whole, text(&campaign("ä"), &[0, 1, 2, 3, 4]).into_bytes());
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
        let header = to_line(&campaign("ä"));
        for other in [
            to_line(&campaign("b")) + "\n",
            format!("{header}\n0\n2\n"),
            format!("{header}\nnonsense\n"),
            format!("{header}\n0\n1\n2\n3\n4\n5\n"),
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
        drop(Store::<u64>::replace(&path, &campaign("ä")).unwrap());
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
