//! Input files, each read once: a run or a study is made from what was read then, whatever happens to the files
//! meanwhile.
//!
//! Everything that reads an input file goes through [`read_text`](super::file::read_text) or
//! [`read_bytes`](super::file::read_bytes); within [`InputFiles::during`] these take a file from memory if it was read
//! before.

use crate::error::{Error, wrong};
use sha2::{Digest, Sha256};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Files from which a run or a study was made. Clones share what was read, across threads too.
#[derive(Clone, Debug, Default)]
pub struct InputFiles {
    shared: Arc<Mutex<Shared>>,
}

#[derive(Debug, Default)]
struct Shared {
    /// Target file of each path; links were followed when the path was first read.
    files: BTreeMap<PathBuf, PathBuf>,
    contents: BTreeMap<PathBuf, Arc<[u8]>>,
    sealed: bool,
    /// Source of files that were not read yet; `None`: the disk.
    whole: Option<InputFiles>,
    /// Address of a program that is not one of these files.
    elsewhere: Option<String>,
}

thread_local! {
    static CURRENT: RefCell<Option<InputFiles>> = const { RefCell::new(None) };
}

/// Restores the previous state, also after a panic.
struct Restore(Option<InputFiles>);

impl Drop for Restore {
    fn drop(&mut self) {
        CURRENT.with(|current| *current.borrow_mut() = self.0.take());
    }
}

impl InputFiles {
    /// Makes a part of a larger whole: a file is read from the whole, and is listed in both.
    pub(crate) fn part_of(whole: Self) -> Self {
        let part = Self::default();
        part.lock().whole = Some(whole);
        part
    }

    /// Runs `work` and keeps the files that it reads; a file that was read before is not read again.
    pub fn during<T>(&self, work: impl FnOnce() -> T) -> T {
        let before = CURRENT.with(|current| current.borrow_mut().replace(self.clone()));
        let _restore = Restore(before);
        work()
    }

    /// Returns the files into which this thread reads at the moment; `None` outside of [`InputFiles::during`].
    pub(crate) fn current() -> Option<Self> {
        CURRENT.with(|current| current.borrow().clone())
    }

    /// Forbids reading from disk from now on: a file that is not here is an error.
    pub fn seal(&self) {
        self.lock().sealed = true;
    }

    /// Stores the address of a program that runs elsewhere and has no check sum.
    pub(crate) fn runs_elsewhere(&self, way: &str) {
        let mut shared = self.lock();
        shared.elsewhere = Some(way.to_owned());
        if let Some(whole) = &shared.whole {
            whole.runs_elsewhere(way);
        }
    }

    /// Address of a program that runs elsewhere, if a run needs one.
    pub fn elsewhere(&self) -> Option<String> {
        self.lock().elsewhere.clone()
    }

    /// True if a file of this path was read.
    pub(crate) fn contains(&self, path: &Path) -> bool {
        let shared = self.lock();
        let whole = shared.whole.as_ref();
        shared.files.contains_key(path) || whole.is_some_and(|whole| whole.contains(path))
    }

    /// SHA-256 of every file, as `sha256sum` prints it, by its name relative to `folder`.
    pub fn digests(&self, folder: &Path) -> BTreeMap<String, String> {
        let named = self.named(folder).into_iter();
        named.map(|(name, bytes)| (name, sha256(&bytes))).collect()
    }

    /// SHA-256 and bytes of every file, each once.
    pub(crate) fn contents(&self) -> Vec<(String, Arc<[u8]>)> {
        let all: Vec<Arc<[u8]>> = self.lock().contents.values().cloned().collect();
        all.into_iter().map(|b| (sha256(&b), b)).collect()
    }

    /// The bytes of a file: as they were when it was first read, else what `read` gives.
    pub(super) fn get(
        &self,
        path: &Path,
        read: impl FnOnce() -> Result<Arc<[u8]>, Error>,
    ) -> Result<Arc<[u8]>, Error> {
        let mut shared = self.lock();
        if let Some(bytes) = shared.files.get(path).and_then(|f| shared.contents.get(f)) {
            return Ok(bytes.clone());
        }
        if shared.sealed {
            let message = "this file was not among the inputs when the study began";
            let help = "start the study again in another folder";
            return Err(wrong(path, None, message, help));
        }
        let file = path.canonicalize().unwrap_or_else(|_| path.into());
        let bytes = match (shared.contents.get(&file), &shared.whole) {
            (Some(bytes), _) => bytes.clone(),
            (None, Some(whole)) => whole.get(path, read)?,
            (None, None) => read()?,
        };
        shared.files.insert(path.into(), file.clone());
        shared.contents.insert(file, bytes.clone());
        Ok(bytes)
    }

    /// The bytes of every file, by its name relative to `folder`.
    pub fn named(&self, folder: &Path) -> BTreeMap<String, Arc<[u8]>> {
        let shared = self.lock();
        let mut named: BTreeMap<String, Arc<[u8]>> = BTreeMap::new();
        for (path, file) in &shared.files {
            let Some(bytes) = shared.contents.get(file) else {
                continue;
            };
            let relative = path.strip_prefix(folder).unwrap_or(path);
            let mut name = tidy(relative);
            // a link between the dots: two files, one name
            if named.get(&name).is_some_and(|other| other != bytes) {
                name = relative.to_string_lossy().into_owned();
            }
            named.insert(name, bytes.clone());
        }
        named
    }

    fn lock(&self) -> MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Two values are equal if they share their files.
impl PartialEq for InputFiles {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.shared, &other.shared)
    }
}

/// SHA-256 as `sha256sum` prints it.
pub(crate) fn sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

/// Bytes as lower-case hexadecimal digits.
pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// `a/../b` is `b`, with forward slashes.
fn tidy(path: &Path) -> String {
    let mut parts: Vec<String> = Vec::new();
    for part in path.components() {
        match part {
            Component::ParentDir if parts.last().is_some_and(|p| p != "..") => {
                parts.pop();
            }
            Component::CurDir => {}
            Component::RootDir => parts.push(String::new()),
            other => parts.push(other.as_os_str().to_string_lossy().into_owned()),
        }
    }
    parts.join("/")
}

/// Files that this program has read, if they are protected.
static READ: Mutex<Option<BTreeSet<PathBuf>>> = Mutex::new(None);

fn read() -> MutexGuard<'static, Option<BTreeSet<PathBuf>>> {
    READ.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Protects the files that this program reads: no result is written over them, under whatever name.
pub fn guard_inputs() {
    read().get_or_insert_default();
}

/// Notes a file as an input.
pub fn note_input(path: &Path) {
    if let (Some(all), Ok(file)) = (read().as_mut(), path.canonicalize()) {
        all.insert(file);
    }
}

/// No longer takes a file for an input: it was asked for that it is changed.
pub fn may_change(path: &Path) {
    if let (Some(all), Ok(file)) = (read().as_mut(), path.canonicalize()) {
        all.remove(&file);
    }
}

/// True for an input file, under any of its names.
pub(crate) fn is_input(place: &Path) -> bool {
    let same = |file: &PathBuf| identity(file).is_some_and(|file| Some(file) == identity(place));
    read().iter().flatten().any(same)
}

/// The identity of a file, whatever its name.
fn identity(path: &Path) -> Option<impl PartialEq> {
    #[cfg(unix)]
    return std::fs::metadata(path).ok().map(|file| {
        use std::os::unix::fs::MetadataExt;
        (file.dev(), file.ino())
    });
    #[cfg(not(unix))]
    path.canonicalize().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::file::read_text;

    #[test]
    fn a_file_is_read_once_and_a_sealed_collection_reads_no_more() {
        let dir = tempfile::tempdir().unwrap();
        let (a, b) = (dir.path().join("a"), dir.path().join("b"));
        std::fs::write(&a, "1").unwrap();
        let files = InputFiles::default();
        let read = |path: &Path| files.during(|| read_text(path));
        assert_eq!(read(&a).unwrap(), "1");
        std::fs::write(&a, "2").unwrap();
        assert_eq!(read(&a).unwrap(), "1");
        assert_eq!(read(&dir.path().join("./a")).unwrap(), "1");
        assert_eq!(read_text(&a).unwrap(), "2");
        files.seal();
        std::fs::write(&b, "3").unwrap();
        assert!(read(&b).unwrap_err().to_string().contains("study began"));
        // FIPS 180-2: SHA-256 of "1" as by sha256sum
        let digest = "6b86b273ff34fce19d6b804eff5a3f5747ada4eaa22f1d49c01e52ddb7875b4b";
        let all = files.digests(dir.path());
        assert_eq!(all, BTreeMap::from([("a".to_owned(), digest.to_owned())]));
        assert_eq!(files.contents(), [(digest.to_owned(), Arc::from(*b"1"))]);
    }

    #[test]
    fn names_are_relative_and_without_detours() {
        for (path, name) in [
            ("../assets/trains/../units/a.yaml", "../assets/units/a.yaml"),
            ("./a.yaml", "a.yaml"),
            ("../../a", "../../a"),
            ("/x/a", "/x/a"),
        ] {
            assert_eq!(tidy(Path::new(path)), name);
        }
    }
}
