//! An FMU: unpacked, checked and its functions looked up once. It stays as long as the program runs.

use super::calls::{Calls, Fmu};
use super::description;
use monorig_sim::closed_loop::registry::Refusal;
use std::collections::BTreeMap;
use std::env::consts::{ARCH, DLL_SUFFIX, OS};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::{Mutex, Once, PoisonError};
use zip::ZipArchive;

/// Largest number of bytes, and of files, of an unpacked FMU.
const MAX_BYTES: u64 = 1 << 30;
const MAX_FILES: usize = 10_000;

/// Beginning of the names of temporary folders.
pub(crate) const FOLDER: &str = "monorig-fmu-";

/// The FMUs of this program, each once.
static LOADED: Mutex<BTreeMap<PathBuf, &'static Fmu>> = Mutex::new(BTreeMap::new());

/// Folder for the folders of FMUs, if this process was given one; else the system's folder for temporary files.
#[cfg(unix)]
static PLACE: std::sync::OnceLock<PathBuf> = std::sync::OnceLock::new();

/// Unpacks FMUs in this folder, which another process removes.
#[cfg(unix)]
pub(crate) fn unpack_in(folder: PathBuf) {
    PLACE.get_or_init(|| folder);
}

/// The folders that FMUs are unpacked in, to be removed at the end of the program.
static FOLDERS: Mutex<Vec<tempfile::TempDir>> = Mutex::new(Vec::new());

extern "C" fn remove_folders() {
    FOLDERS
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .clear();
}

unsafe extern "C" {
    fn atexit(function: extern "C" fn()) -> i32;
}

/// A folder of its own until the program ends.
fn folder() -> std::io::Result<PathBuf> {
    let mut new = tempfile::Builder::new();
    let new = new.prefix(FOLDER);
    #[cfg(unix)]
    if let Some(place) = PLACE.get() {
        return Ok(new.tempdir_in(place)?.keep());
    }
    static AT_EXIT: Once = Once::new();
    AT_EXIT.call_once(|| {
        // SAFETY: the function of the standard library of C; what it is given lives as long as the program.
        let _ = unsafe { atexit(remove_folders) };
    });
    let folder = new.tempdir()?;
    let path = folder.path().to_owned();
    FOLDERS
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .push(folder);
    Ok(path)
}

/// Names of the folder in `binaries/` that this machine can use.
fn platforms(three: bool) -> Vec<String> {
    let system = match OS {
        "macos" => "darwin",
        other => other,
    };
    let of_three = format!("{ARCH}-{system}");
    let of_two = match (ARCH, OS) {
        ("x86_64", "linux") => "linux64",
        ("x86_64", "windows") => "win64",
        (_, "macos") => "darwin64",
        _ => return vec![of_three],
    };
    match three {
        true => vec![of_three],
        false => vec![of_two.to_owned(), of_three],
    }
}

impl Fmu {
    /// The FMU of this file.
    pub fn load(path: &Path) -> Result<&'static Self, Refusal> {
        let file = path.canonicalize().unwrap_or_else(|_| path.into());
        let mut loaded = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(fmu) = loaded.get(&file) {
            return Ok(fmu);
        }
        let fmu: &'static Self = Box::leak(Box::new(Self::of(path)?));
        loaded.insert(file, fmu);
        Ok(fmu)
    }

    fn of(path: &Path) -> Result<Self, Refusal> {
        let at = path.display().to_string();
        let folder = unpack(path, &at)?;
        let xml = std::fs::read(folder.join("modelDescription.xml")).map_err(|_| {
            let help =
                "use an FMU as exported by its tool: a zip archive with the description at its top";
            Refusal::new(format!("{at} has no modelDescription.xml"), help)
        })?;
        let description = description::read(&at, &xml)?;
        let binaries = folder.join("binaries");
        let name = format!("{}{DLL_SUFFIX}", description.identifier);
        let platforms = platforms(description.three);
        let mut places = platforms.iter().map(|p| binaries.join(p).join(&name));
        let Some(library) = places.find(|p| p.is_file()) else {
            return Err(no_binary(&at, &binaries, &platforms.join(" or "), &name));
        };
        Ok(Self {
            calls: Calls::load(&at, &library, description.three)?,
            in_use: description.one_at_a_time.then(AtomicBool::default),
            resources: folder.join("resources"),
            description,
            at,
        })
    }
}

/// Text with the existing binaries instead of a binary for this machine.
fn no_binary(at: &str, binaries: &Path, wanted: &str, name: &str) -> Refusal {
    let there = std::fs::read_dir(binaries).into_iter().flatten().flatten();
    let mut there: Vec<String> = there
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect();
    there.sort();
    let there = match there.is_empty() {
        true => "none at all".to_owned(),
        false => there.join(", "),
    };
    Refusal::new(
        format!("{at} has no binary for this machine (binaries/{wanted}/{name}); it has {there}"),
        "export it on or for a system like this one; an FMU with only sources must be compiled first",
    )
}

/// Unpacks an FMU into a folder of its own.
fn unpack(path: &Path, at: &str) -> Result<PathBuf, Refusal> {
    let no_zip = |why: String| {
        let help = "use an FMU as exported by its tool: a zip archive";
        Refusal::new(format!("{at} cannot be unpacked: {why}"), help)
    };
    let io = |e: std::io::Error| no_zip(e.to_string());
    let file = std::fs::File::open(path).map_err(io)?;
    let mut archive = ZipArchive::new(file).map_err(|e| no_zip(e.to_string()))?;
    if archive.len() > MAX_FILES {
        return Err(no_zip(format!("it has {} files", archive.len())));
    }
    let folder = folder().map_err(io)?;
    let mut left = MAX_BYTES;
    for index in 0..archive.len() {
        let entry = archive.by_index(index).map_err(|e| no_zip(e.to_string()))?;
        let Some(name) = entry.enclosed_name() else {
            let name = entry.name().map(String::from).unwrap_or_default();
            return Err(no_zip(format!("`{name}` in it leads out of the archive")));
        };
        let place = folder.join(name);
        if entry.is_dir() {
            std::fs::create_dir_all(&place).map_err(io)?;
            continue;
        }
        std::fs::create_dir_all(place.parent().unwrap_or(&folder)).map_err(io)?;
        let mut to = std::fs::File::create(&place).map_err(io)?;
        let copied = std::io::copy(&mut entry.take(left), &mut to).map_err(io)?;
        left -= copied;
        if left == 0 {
            return Err(no_zip(format!("it has more than {} GB", MAX_BYTES >> 30)));
        }
    }
    Ok(folder)
}
