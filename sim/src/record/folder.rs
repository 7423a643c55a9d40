//! The folder of one run, `<root>/<scenario>/<seed>/`: filled under a temporary name, moved into place when whole.

use crate::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

/// A run folder that is being filled. [`RunFolder::commit`] moves it into place; dropped without, it is removed, and so is
/// the scenario's folder if no run is left in it.
pub struct RunFolder {
    partial: PathBuf,
    place: PathBuf,
    committed: bool,
}

impl RunFolder {
    /// An empty temporary folder beside the place of the run. An older run of the same seed stays until `commit`.
    pub fn create(root: &Path, scenario: &str, seed: u64) -> Result<Self, Error> {
        let parent = root.join(scenario);
        fs::create_dir_all(&parent).map_err(|e| at(&parent, e))?;
        clear_orphans(&parent, seed);
        let partial = parent.join(format!(".{seed}.partial-{}", std::process::id()));
        remove(&partial)?;
        fs::create_dir(&partial).map_err(|e| at(&partial, e))?;
        Ok(Self {
            partial,
            place: parent.join(seed.to_string()),
            committed: false,
        })
    }

    /// Where files go until `commit`.
    pub fn path(&self) -> &Path {
        &self.partial
    }

    /// Where the folder will be.
    pub fn place(&self) -> &Path {
        &self.place
    }

    /// Write a whole file into the folder.
    pub fn write(&self, name: &str, contents: &[u8]) -> Result<(), Error> {
        let path = self.partial.join(name);
        fs::write(&path, contents).map_err(|e| at(&path, e))
    }

    /// Move the folder into place. An older run of the same seed is replaced; if that fails, it is put back.
    pub fn commit(mut self) -> Result<PathBuf, Error> {
        let name = self.partial.file_name().unwrap_or_default().to_owned();
        let mut aside = name;
        aside.push(".old");
        let aside = self.place.with_file_name(aside);
        remove(&aside)?;
        let had_older = self.place.exists();
        if had_older {
            fs::rename(&self.place, &aside).map_err(|e| at(&self.place, e))?;
        }
        if let Err(e) = fs::rename(&self.partial, &self.place) {
            if had_older {
                fs::rename(&aside, &self.place).map_err(|e| at(&aside, e))?;
            }
            return Err(at(&self.place, e));
        }
        self.committed = true;
        remove(&aside)?;
        Ok(self.place.clone())
    }
}

impl Drop for RunFolder {
    fn drop(&mut self) {
        if !self.committed {
            let _ = fs::remove_dir_all(&self.partial);
            if let Some(parent) = self.partial.parent() {
                let _ = fs::remove_dir(parent); // goes only if it is empty: no other seed is there
            }
        }
    }
}

/// Remove what killed processes left of this seed. A process that still runs keeps its folder.
fn clear_orphans(parent: &Path, seed: u64) {
    let prefix = format!(".{seed}.partial-");
    let processes = Path::new("/proc");
    if !processes.join("self").exists() {
        return;
    }
    for entry in fs::read_dir(parent).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let owner = name.to_str().and_then(|n| n.strip_prefix(&prefix));
        if owner.is_some_and(|pid| pid.parse::<u32>().is_ok() && !processes.join(pid).exists()) {
            let _ = fs::remove_dir_all(entry.path());
        }
    }
}

fn remove(path: &Path) -> Result<(), Error> {
    match fs::remove_dir_all(path) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(at(path, e)),
        _ => Ok(()),
    }
}

fn at(path: &Path, source: std::io::Error) -> Error {
    Error::Io {
        path: path.into(),
        source,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entries(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .unwrap()
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn whole_or_not_at_all() {
        let root = tempfile::tempdir().unwrap();
        let folder = RunFolder::create(root.path(), "hill", 3).unwrap();
        folder.write("a", b"1").unwrap();
        assert!(!folder.place().exists(), "visible before it is whole");
        drop(folder);
        assert_eq!(entries(root.path()), [""; 0]);

        let folder = RunFolder::create(root.path(), "hill", 3).unwrap();
        folder.write("a", b"1").unwrap();
        let place = folder.commit().unwrap();
        assert_eq!(place, root.path().join("hill/3"));
        assert_eq!(fs::read(place.join("a")).unwrap(), b"1");
    }

    #[test]
    fn replaces_an_older_run_entirely_and_only_when_whole() {
        let root = tempfile::tempdir().unwrap();
        for (file, text) in [("old", "1"), ("new", "2")] {
            let folder = RunFolder::create(root.path(), "hill", 3).unwrap();
            folder.write(file, text.as_bytes()).unwrap();
            if file == "new" {
                assert_eq!(entries(folder.place()), ["old"]);
            }
            folder.commit().unwrap();
        }
        assert_eq!(entries(&root.path().join("hill")), ["3"]);
        assert_eq!(entries(&root.path().join("hill/3")), ["new"]);
    }

    /// If the new run cannot be moved into place, the older one is back where it was.
    #[test]
    fn failed_commit_keeps_the_older_run() {
        let root = tempfile::tempdir().unwrap();
        let folder = RunFolder::create(root.path(), "hill", 3).unwrap();
        folder.write("old", b"1").unwrap();
        folder.commit().unwrap();
        let folder = RunFolder::create(root.path(), "hill", 3).unwrap();
        fs::remove_dir_all(folder.path()).unwrap();
        assert!(matches!(folder.commit(), Err(Error::Io { .. })));
        assert_eq!(entries(&root.path().join("hill")), ["3"]);
        assert_eq!(entries(&root.path().join("hill/3")), ["old"]);
    }

    #[test]
    fn orphans_go_and_the_living_stay() {
        let root = tempfile::tempdir().unwrap();
        let parent = root.path().join("hill");
        let living = format!(".3.partial-{}", std::os::unix::process::parent_id());
        for name in [".3.partial-4294967295", &living, "4"] {
            fs::create_dir_all(parent.join(name)).unwrap();
        }
        let folder = RunFolder::create(root.path(), "hill", 3).unwrap();
        folder.commit().unwrap();
        assert_eq!(entries(&parent), [living.as_str(), "3", "4"]);
    }

    #[test]
    fn a_root_that_is_a_file_is_an_error_that_names_it() {
        let root = tempfile::tempdir().unwrap();
        let file = root.path().join("runs");
        fs::write(&file, "").unwrap();
        match RunFolder::create(&file, "hill", 3) {
            Err(Error::Io { path, .. }) => assert!(path.starts_with(&file)),
            _ => panic!("a file was taken for a folder"),
        }
    }
}
