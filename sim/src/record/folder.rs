//! The folder of one run, `<root>/<scenario>/<seed>/`: filled under a temporary name, moved into place when whole.

use super::whole;
use crate::config::file::input_error;
use crate::error::Error;
use std::fs;
use std::path::{Component, Path, PathBuf};

/// A run folder that is being filled. [`RunFolder::commit`] moves it into place; dropped without, it is removed, and so
/// is the scenario's folder if no run is left in it.
pub struct RunFolder {
    partial: PathBuf,
    place: PathBuf,
    committed: bool,
}

impl RunFolder {
    /// An empty temporary folder beside the place of the run. An older run of the same seed stays until `commit`.
    pub fn create(root: &Path, scenario: &str, seed: u64) -> Result<Self, Error> {
        let parent = parent(root, scenario)?;
        only_results(&parent.join(seed.to_string()))?;
        only_results(&parent.join(format!("{seed}{INTERRUPTED}")))?;
        fs::create_dir_all(&parent).map_err(Error::at(&parent))?;
        clear_orphans(&parent, seed);
        let partial = parent.join(format!("{}{}", prefix(seed), whole::unique()));
        remove(&partial)?;
        fs::create_dir(&partial).map_err(Error::at(&partial))?;
        Ok(Self {
            partial,
            place: parent.join(seed.to_string()),
            committed: false,
        })
    }

    /// Folder of the files until `commit`.
    pub fn path(&self) -> &Path {
        &self.partial
    }

    /// Write a whole file into the folder.
    pub fn write(&self, name: &str, contents: &[u8]) -> Result<(), Error> {
        let path = self.partial.join(name);
        fs::write(&path, contents).map_err(Error::at(&path))
    }

    /// Move the folder of a whole run into place. An older run of the same seed is replaced in one step, so that one of
    /// the two is there whenever the process is killed.
    pub fn commit(self) -> Result<PathBuf, Error> {
        self.move_to_place()
    }

    /// Move the folder of a run that was interrupted into place; beside it, as `<seed>.interrupted`, if there is an
    /// older run of the same seed, which stays.
    pub fn commit_interrupted(mut self) -> Result<PathBuf, Error> {
        if self.place.exists() {
            let mut name = self.place.file_name().unwrap_or_default().to_owned();
            name.push(INTERRUPTED);
            self.place.set_file_name(name);
        }
        self.move_to_place()
    }

    fn move_to_place(mut self) -> Result<PathBuf, Error> {
        match self.place.exists() {
            true => exchange(&self.partial, &self.place)?,
            false => fs::rename(&self.partial, &self.place).map_err(Error::at(&self.place))?,
        }
        self.committed = true;
        remove(&self.partial)?; // the older run, if there was one
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

/// Accepts what can be the name of a file or folder in another folder: one part of a path that leads nowhere else, and
/// no control character. A name that a file gives is held against this before anything is read or written under it.
pub fn is_name(name: &str) -> bool {
    let mut parts = Path::new(name).components();
    let one = matches!((parts.next(), parts.next()), (Some(Component::Normal(part)), None) if part == name);
    one && name.len() <= MAX_NAME_BYTES
        && !name.contains(['/', '\\'])
        && !name.contains(char::is_control)
}

/// Longest name, bytes: file systems allow 255, and monorig appends to names.
const MAX_NAME_BYTES: usize = 200;

/// The folder of a scenario's runs, directly in `root`: a name that leads elsewhere is refused.
fn parent(root: &Path, scenario: &str) -> Result<PathBuf, Error> {
    let parent = root.join(scenario);
    match is_name(scenario) {
        true => Ok(parent),
        false => Err(Error::at(&parent)(std::io::Error::new(
            std::io::ErrorKind::InvalidInput,
            format!(
                "`{scenario}` cannot be the name of a folder; give the scenario file another name"
            ),
        ))),
    }
}

/// Ending of the folder of a run that was interrupted, beside a whole one.
const INTERRUPTED: &str = ".interrupted";

/// Files that commands leave in the folder of a run, beside pages.
const RESULTS: [&str; 6] = [
    "channels.parquet",
    "explain.json",
    "manifest.json",
    "metrics.json",
    "run.rrd",
    "samples.parquet",
];

/// Refuses a place with anything in it that is no result of a run: a new run takes the place whole.
fn only_results(place: &Path) -> Result<(), Error> {
    for entry in fs::read_dir(place).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if !(RESULTS.contains(&&*name) || name.ends_with(".html")) {
            let message = "this is in the folder of a run, which a new run takes the place of";
            let help = "move it elsewhere, or name another folder for results with --out";
            return Err(input_error(&entry.path(), "", message, help));
        }
    }
    Ok(())
}

/// Swap a new folder with the one in its place.
fn exchange(new: &Path, place: &Path) -> Result<(), Error> {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        use nix::fcntl::{AT_FDCWD, RenameFlags, renameat2};
        let swapped = renameat2(AT_FDCWD, new, AT_FDCWD, place, RenameFlags::RENAME_EXCHANGE);
        if swapped.is_ok() {
            return Ok(());
        }
    }
    // a system or a disk that cannot swap: in two steps
    let mut aside = new.as_os_str().to_owned();
    aside.push(OLD);
    let aside = PathBuf::from(aside);
    remove(&aside)?;
    fs::rename(place, &aside).map_err(Error::at(place))?;
    if let Err(e) = fs::rename(new, place) {
        fs::rename(&aside, place).map_err(Error::at(&aside))?;
        return Err(Error::at(place)(e));
    }
    fs::rename(&aside, new).map_err(Error::at(&aside))
}

/// Ending of an older run's folder while it is replaced in two steps.
const OLD: &str = ".old";

/// Beginning of the names of a seed's temporary folders.
fn prefix(seed: u64) -> String {
    format!(".{seed}.partial-")
}

/// Put back an older run whose replacement was killed between two steps, and remove what else killed processes left of
/// this seed. A process that still runs keeps its folder. Where the system does not list its processes in `/proc`, that
/// is what has changed within a day.
fn clear_orphans(parent: &Path, seed: u64) {
    let prefix = prefix(seed);
    let processes = Path::new("/proc");
    let listed = processes.join("self").exists();
    for entry in fs::read_dir(parent).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let Some(owner) = name.to_str().and_then(|n| n.strip_prefix(&prefix)) else {
            continue;
        };
        let mut parts = owner.split(['-', '.']);
        let (pid, where_it_counts) = (parts.next().unwrap_or_default(), parts.next());
        let alive = match listed && where_it_counts == Some(whole::processes()) {
            true => processes.join(pid).exists(),
            false => recently_changed(&entry.path()), // of another container on the same disk?
        };
        if alive {
            continue;
        }
        let place = parent.join(seed.to_string());
        if owner.ends_with(OLD) && !place.exists() && fs::rename(entry.path(), &place).is_ok() {
            continue;
        }
        let _ = fs::remove_dir_all(entry.path());
    }
}

/// True if something in a folder was written within the last day.
fn recently_changed(folder: &Path) -> bool {
    const ABANDONED_S: u64 = 24 * 3600;
    let inside = fs::read_dir(folder).into_iter().flatten().flatten();
    let all = inside.map(|e| e.path()).chain([folder.to_owned()]);
    let ages = all.filter_map(|path| fs::metadata(path).ok()?.modified().ok()?.elapsed().ok());
    ages.min().is_some_and(|age| age.as_secs() < ABANDONED_S)
}

fn remove(path: &Path) -> Result<(), Error> {
    match fs::remove_dir_all(path) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Error::at(path)(e)),
        _ => Ok(()),
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

    /// Whatever a name is made of, one that is accepted is a file directly in the folder.
    #[test]
    fn a_name_that_is_accepted_leads_nowhere_else() {
        const PIECES: [&str; 14] = [
            "..", "/", "\\", ".", "a", "é", " ", "\0", "\u{1b}", "C:", "@", "~", "run", "\n",
        ];
        let mut random = monorig_testing::Random::new(monorig_testing::mutants::first_seed());
        let mut accepted = 0;
        for _ in 0..monorig_testing::mutants::count(2000) {
            let pieces = (0..random.below(5)).map(|_| *random.of(&PIECES));
            let name = pieces.collect::<Vec<_>>().concat();
            if !is_name(&name) {
                continue;
            }
            accepted += 1;
            let place = Path::new("/root/of/results").join(&name);
            assert_eq!(
                place.parent(),
                Some(Path::new("/root/of/results")),
                "{name:?}"
            );
            assert_eq!(
                place.file_name().and_then(|n| n.to_str()),
                Some(name.as_str())
            );
            assert!(!name.contains(char::is_control), "{name:?}");
        }
        assert!(accepted > 0 && is_name("hill@5t") && !is_name(&"a".repeat(300)));
    }

    #[test]
    fn whole_or_not_at_all() {
        let root = tempfile::tempdir().unwrap();
        let folder = RunFolder::create(root.path(), "hill", 3).unwrap();
        folder.write("a", b"1").unwrap();
        assert!(!folder.place.exists(), "visible before it is whole");
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
        for (file, text) in [("old.html", "1"), ("new.html", "2")] {
            let folder = RunFolder::create(root.path(), "hill", 3).unwrap();
            folder.write(file, text.as_bytes()).unwrap();
            if file == "new.html" {
                assert_eq!(entries(&folder.place), ["old.html"]);
            }
            folder.commit().unwrap();
        }
        assert_eq!(entries(&root.path().join("hill")), ["3"]);
        assert_eq!(entries(&root.path().join("hill/3")), ["new.html"]);
    }

    /// If the new run cannot be moved into place, the older one is back where it was.
    #[test]
    fn failed_commit_keeps_the_older_run() {
        let root = tempfile::tempdir().unwrap();
        let folder = RunFolder::create(root.path(), "hill", 3).unwrap();
        folder.write("old.html", b"1").unwrap();
        folder.commit().unwrap();
        let folder = RunFolder::create(root.path(), "hill", 3).unwrap();
        fs::remove_dir_all(folder.path()).unwrap();
        assert!(matches!(folder.commit(), Err(Error::Io { .. })));
        assert_eq!(entries(&root.path().join("hill")), ["3"]);
        assert_eq!(entries(&root.path().join("hill/3")), ["old.html"]);
    }

    /// An interrupted run does not take the place of a whole one.
    #[test]
    fn interrupted_run_goes_beside_an_older_one() {
        let root = tempfile::tempdir().unwrap();
        let write = |name: &str| {
            let folder = RunFolder::create(root.path(), "hill", 3).unwrap();
            folder.write(name, b"1").unwrap();
            folder
        };
        assert!(
            write("torn.html")
                .commit_interrupted()
                .unwrap()
                .ends_with("3")
        );
        assert!(write("whole.html").commit().unwrap().ends_with("3"));
        for _ in 0..2 {
            let place = write("torn.html").commit_interrupted().unwrap();
            assert!(place.ends_with("3.interrupted"));
        }
        assert_eq!(entries(&root.path().join("hill")), ["3", "3.interrupted"]);
        assert_eq!(entries(&root.path().join("hill/3")), ["whole.html"]);
    }

    /// Files that no command leaves there are not removed with an older run: nothing begins.
    #[test]
    fn a_place_with_anything_but_results_is_refused_as_it_is() {
        for other in ["scenario.yaml", "notes.txt", "deep/run.rrd", "sample.csv"] {
            for place in ["hill/3", "hill/3.interrupted"] {
                let root = tempfile::tempdir().unwrap();
                let file = root.path().join(place).join(other);
                fs::create_dir_all(file.parent().unwrap()).unwrap();
                fs::write(&file, "mine").unwrap();
                let told = RunFolder::create(root.path(), "hill", 3).err().unwrap();
                assert!(told.to_string().contains("--out"), "{told}");
                assert_eq!(fs::read(&file).unwrap(), b"mine");
                assert_eq!(entries(&root.path().join("hill")).len(), 1);
            }
        }
    }

    /// Killed between the two steps of a replacement, the older run is back at the next start.
    #[test]
    fn older_run_is_put_back_after_a_kill() {
        let root = tempfile::tempdir().unwrap();
        let aside = format!("hill/.3.partial-4294967295-{}-0.old", whole::processes());
        let aside = root.path().join(aside);
        fs::create_dir_all(&aside).unwrap();
        fs::write(aside.join("whole"), "1").unwrap();
        drop(RunFolder::create(root.path(), "hill", 3).unwrap());
        assert_eq!(entries(&root.path().join("hill")), ["3"]);
        assert_eq!(entries(&root.path().join("hill/3")), ["whole"]);
    }

    #[test]
    fn a_name_that_leads_elsewhere_is_refused() {
        let root = tempfile::tempdir().unwrap();
        for name in ["..", ".", "", "a/b", "../a"] {
            assert!(RunFolder::create(root.path(), name, 3).is_err(), "{name}");
        }
        assert!(entries(root.path()).is_empty());
    }

    /// Folders of dead processes go at once; those of living ones stay, and those of other containers, where process
    /// ids say nothing, for a day.
    #[test]
    fn orphans_go_and_the_living_stay() {
        let root = tempfile::tempdir().unwrap();
        let parent = root.path().join("hill");
        let (here, living) = (whole::processes(), std::os::unix::process::parent_id());
        let long_ago = std::time::SystemTime::now() - std::time::Duration::from_secs(200_000);
        let mut stay = vec!["3".to_owned(), "4".to_owned()];
        for (name, old, stays) in [
            (format!(".3.partial-4294967295-{here}-0"), false, false),
            (format!(".3.partial-{living}-{here}-0"), true, true),
            (format!(".3.partial-{living}-elsewhere-0"), true, false),
            (".3.partial-4294967295-elsewhere-0".to_owned(), false, true),
            ("4".to_owned(), true, false),
        ] {
            fs::create_dir_all(parent.join(&name)).unwrap();
            if old {
                let folder = fs::File::open(parent.join(&name)).unwrap();
                folder.set_modified(long_ago).unwrap();
            }
            stay.extend(stays.then_some(name));
        }
        let folder = RunFolder::create(root.path(), "hill", 3).unwrap();
        folder.commit().unwrap();
        stay.sort_unstable();
        assert_eq!(entries(&parent), stay);
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
