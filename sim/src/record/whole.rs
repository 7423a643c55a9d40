//! Files that are there whole or not at all: written under a temporary name, then moved into place.

use crate::config::input_files::{is_input, sha256};
use crate::error::Error;
use std::fs::{File, OpenOptions};
use std::hash::{BuildHasher, Hasher, RandomState};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// A name for temporary files that no other process has, in another container on the same disk neither: process id,
/// where that id counts ([`processes`]), and random bits.
pub fn unique() -> &'static str {
    static NAME: OnceLock<String> = OnceLock::new();
    NAME.get_or_init(|| {
        // seeded by the system's random numbers
        let random = RandomState::new().build_hasher().finish() as u32;
        format!("{}-{}-{random:08x}", std::process::id(), processes())
    })
}

/// Identifies the machine since its last start, and the container, in which process ids count: the same process id
/// elsewhere is another process.
pub(crate) fn processes() -> &'static str {
    static NAME: OnceLock<String> = OnceLock::new();
    NAME.get_or_init(|| {
        let boot = std::fs::read("/proc/sys/kernel/random/boot_id").unwrap_or_default();
        let ids = std::fs::read_link("/proc/self/ns/pid").unwrap_or_default();
        let both = [boot.as_slice(), ids.as_os_str().as_encoded_bytes()].concat();
        sha256(&both).chars().take(8).collect()
    })
}

/// The temporary name beside a place: hidden, and no other process's.
pub fn partial(place: &Path) -> PathBuf {
    let mut name = std::ffi::OsString::from(".");
    name.push(place.file_name().unwrap_or_default());
    name.push(format!(".partial-{}", unique()));
    place.with_file_name(name)
}

/// A new file of this name; whatever else stands there (a link, a device) is left alone.
pub fn create(path: &Path) -> Result<File, Error> {
    let _ = std::fs::remove_file(path); // a link goes, not what it leads to
    let mut options = OpenOptions::new();
    let file = options.write(true).create_new(true).open(path);
    file.map_err(Error::at(path))
}

/// Write a whole file. What stands in its place is replaced if it is a file; a link, a device or a folder is refused.
pub fn write(place: &Path, bytes: &[u8]) -> Result<(), Error> {
    replaceable(place)?;
    let partial = partial(place);
    let written =
        create(&partial).and_then(|mut file| file.write_all(bytes).map_err(Error::at(place)));
    let moved = written.and_then(|()| std::fs::rename(&partial, place).map_err(Error::at(place)));
    if moved.is_err() {
        let _ = std::fs::remove_file(&partial);
    }
    moved
}

/// Refuses a place at which something other than a regular file stands, or an input of this program.
pub fn replaceable(place: &Path) -> Result<(), Error> {
    let what = match std::fs::symlink_metadata(place) {
        Ok(there) if there.is_symlink() => {
            "this is a link: what it leads to would be written; name the file itself"
        }
        Ok(there) if !there.is_file() => "this is not a regular file, and is not written over",
        Ok(_) if is_input(place) => {
            "this is an input of this command, and is not written over; name another file for the result"
        }
        _ => return Ok(()),
    };
    let source = std::io::Error::new(std::io::ErrorKind::InvalidInput, what);
    Err(Error::at(place)(source))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_and_devices_are_refused_and_left_alone() {
        let dir = tempfile::tempdir().unwrap();
        let (file, link) = (dir.path().join("file"), dir.path().join("link"));
        write(&file, b"1").unwrap();
        write(&file, b"2").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        assert!(write(&link, b"3").is_err());
        assert!(write(Path::new("/dev/null"), b"3").is_err());
        assert!(write(dir.path(), b"3").is_err());
        assert_eq!(std::fs::read(&file).unwrap(), b"2");
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 2);
    }
}
