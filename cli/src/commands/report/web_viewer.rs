//! The web viewer of Rerun, found in the program `rerun` of the Python package `rerun-sdk`; only the published files
//! are accepted.
//!
//! The program carries script and WebAssembly module to serve them; they are taken from it as they are. What is taken
//! has the SHA-256 of a build of the version that writes our recordings: nothing else gets into a page.

use crate::ui::errors::CliError;
use crate::ui::note::detail;
use monorig_sim::config::file::{input_error, read_large};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// The version of Rerun that writes our recordings.
pub const VERSION: &str = "0.36.3";

/// Script and module of the viewer.
pub struct WebViewer {
    /// `re_viewer.js`.
    pub script: String,
    /// `re_viewer_bg.wasm`.
    pub module: Vec<u8>,
}

/// A published file: its length in bytes and its SHA-256.
struct Pinned(usize, &'static str);

/// Makes the list of the published builds from lengths and check sums of script and module.
macro_rules! pinned {
    ($($script:literal $sum:literal $module:literal $of_module:literal;)*) => {
        [$((Pinned($script, $sum), Pinned($module, $of_module))),*]
    };
}

/// Script and module in the wheels of `rerun-sdk` 0.36.3 on PyPI: Linux x86-64, Linux arm64, Windows x86-64, macOS
/// arm64.
const BUILDS: [(Pinned, Pinned); 4] = pinned! {
    227_616 "3dd59bbd7edf1c532d2896f5cb90acc2523990714e9849024c626cc95d093237"
    41_729_988 "8c29034ab9638de96624bb3b124e5090d972788cbc1318929616907b5049de3b";
    227_616 "b7923c68b317a177875ce0f220f22a74a2efc2d9fd7a84026e21b615c6ad2aea"
    41_731_971 "b6bd6dbc92cc176302f34bd3c7668747b29805489cf30e6d9565381e3f208638";
    227_616 "c57ee01c200f85225b44844911d32689c854b1b0af182a36b1d96ff152c4e2ee"
    41_754_511 "015d861e0d7f0e1658c7af543d301fff6e79e7c880c1af81ff7ea0aae2665c2f";
    227_616 "f0627cebcf10d8c61e1d897dd32c1f81dc563dfa6fdaf7ac8c6508c58c4c48dd"
    41_749_845 "009789ce135476e7a32f0230610b3ea11b44c8f2e37aa760b2b014c975fceb6e";
};

/// First bytes of a WebAssembly module of version 1.
const MODULE_BEGINS: &[u8] = b"\0asm\x01\0\0\0";
/// First bytes of the script.
const SCRIPT_BEGINS: &[u8] = b"let wasm_bindgen = (function(exports)";

/// Path of the program in a folder of Python packages.
const PROGRAM: &str = "rerun_sdk/rerun_cli";
/// Name of the program there, by system.
const NAMES: [&str; 3] = ["rerun", "rerun.exe", "Rerun.app/Contents/MacOS/Rerun"];

/// Finds the viewer in the program `named`, or in the program of a package `rerun-sdk` beside a folder of the search
/// path. Nothing is run.
pub fn find(named: Option<&Path>) -> Result<WebViewer, CliError> {
    let program = match named {
        Some(program) => program.to_owned(),
        None => installed()?,
    };
    detail(&format!("the viewer is taken from {}", program.display()));
    let bytes = read_large(&program)?;
    extract(&bytes).ok_or_else(|| {
        let message =
            format!("this program does not contain the published web viewer of Rerun {VERSION}");
        CliError::Sim(input_error(&program, "", message, install()))
    })
}

/// Help for a missing viewer.
fn install() -> String {
    format!(
        "install it with `python3 -m pip install rerun-sdk=={VERSION}`, or name the program `rerun` of that version with --viewer"
    )
}

/// Program of an installed package: first in the active environment, then in the user's packages.
fn installed() -> Result<PathBuf, CliError> {
    let programs = package_folders().into_iter().flat_map(|folder| {
        let program = folder.join(PROGRAM);
        NAMES.map(|name| program.join(name))
    });
    let found = programs.into_iter().find(|p| p.is_file());
    found.ok_or_else(|| {
        let message = format!(
            "the web viewer of Rerun {VERSION} is needed, and rerun-sdk is not installed beside a folder of PATH"
        );
        CliError::refused(message, install())
    })
}

/// Folders of Python packages: below the folder above each absolute one of PATH (`/usr/bin` →
/// `/usr/lib/python3.12/site-packages`), and below that of the user. A relative folder is left out: it would be one of
/// the current folder.
fn package_folders() -> Vec<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let absolute = std::env::split_paths(&path).filter(|f| f.is_absolute());
    let above = absolute.filter_map(|f| f.parent().map(Path::to_owned));
    let home = std::env::var_os("HOME").map(PathBuf::from);
    let user = home.iter().map(|h| h.join(".local"));
    above
        .chain(user)
        .flat_map(|root| packages_below(&root))
        .collect()
}

/// Folders of Python packages below the root of an installation, newest Python first.
fn packages_below(root: &Path) -> Vec<PathBuf> {
    let lib = root.join("lib");
    let entries = std::fs::read_dir(&lib).into_iter().flatten().flatten();
    let pythons = entries.map(|e| e.path());
    let is_python = |p: &PathBuf| {
        p.file_name()
            .is_some_and(|n| n.to_string_lossy().starts_with("python3"))
    };
    let mut pythons: Vec<PathBuf> = pythons.filter(is_python).collect();
    pythons.sort();
    // Windows has no folder for the version
    pythons.insert(0, root.join("Lib"));
    let folders = |p: PathBuf| ["site-packages", "dist-packages"].map(|name| p.join(name));
    pythons.into_iter().rev().flat_map(folders).collect()
}

/// Script and module of one of the builds, as contained in a program.
fn extract(program: &[u8]) -> Option<WebViewer> {
    BUILDS.iter().find_map(|(script, module)| {
        let module = module.find(program, MODULE_BEGINS)?;
        let script = script.find(program, SCRIPT_BEGINS)?;
        Some(WebViewer {
            script: String::from_utf8(script.to_vec()).ok()?,
            module: module.to_vec(),
        })
    })
}

impl Pinned {
    /// The file in `bytes`, if `bytes` contains the file as published.
    fn find<'a>(&self, bytes: &'a [u8], begins: &[u8]) -> Option<&'a [u8]> {
        let Self(length, sum) = self;
        let starts = bytes.windows(begins.len()).enumerate();
        let mut starts = starts.filter(|(_, window)| *window == begins);
        starts.find_map(|(at, _)| {
            let file = bytes.get(at..at.checked_add(*length)?)?;
            let hash = Sha256::digest(file);
            let hex: String = hash.iter().map(|byte| format!("{byte:02x}")).collect();
            (hex == *sum).then_some(file)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// FIPS 180-2, appendix B.1: SHA-256 of "abc".
    #[test]
    fn only_what_has_its_sum_is_taken() {
        let abc = Pinned(
            3,
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad",
        );
        assert_eq!(abc.find(b"..ab.abd.abc", b"ab"), Some(&b"abc"[..]));
        assert_eq!(abc.find(b"..ab.abd.ab", b"ab"), None);
        assert_eq!(abc.find(b"", b"ab"), None);
    }

    #[test]
    fn the_package_of_the_newest_python_comes_first() {
        let root = tempfile::tempdir().unwrap();
        for python in ["python3.11", "python3.12", "other"] {
            let folder = root.path().join("lib").join(python);
            std::fs::create_dir_all(folder).unwrap();
        }
        let found = packages_below(root.path());
        let lib = root.path().join("lib");
        assert_eq!(found.first(), Some(&lib.join("python3.12/site-packages")));
        assert!(!found.iter().any(|f| f.starts_with(lib.join("other"))));
    }

    #[test]
    fn a_program_without_viewer_has_none() {
        let mut fake = MODULE_BEGINS.to_vec();
        fake.extend(SCRIPT_BEGINS);
        assert!(extract(&fake).is_none());
    }

    /// The recordings are written by the version whose viewer is asked for.
    #[test]
    fn the_version_is_that_of_the_recordings() {
        let lock = Path::new(env!("CARGO_MANIFEST_DIR")).join("../Cargo.lock");
        let lock = std::fs::read_to_string(lock).unwrap();
        assert!(lock.contains(&format!("name = \"re_sdk\"\nversion = \"{VERSION}\"")));
    }
}
