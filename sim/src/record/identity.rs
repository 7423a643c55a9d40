//! Identity of the program that made a result: a program does not continue results of another program.

use super::arithmetic;
use crate::config::input_files::hex;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fmt;
use std::fs::File;
use std::path::Path;
use std::sync::OnceLock;

/// Program that made a result, and its arithmetic. Two with one identity give the same bits.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Identity {
    /// Version of monorig.
    pub(crate) version: String,
    /// Git revision of monorig's source, with `-dirty` at its end if a source file was changed later; `unknown` if
    /// monorig was built without git.
    pub(crate) revision: String,
    /// SHA-256 of the program file: another compiler, another flag or an estimator of one's own makes another program.
    pub(crate) program: String,
    /// Probe of the machine's elementary functions: machines with another may compute other bits with the same program.
    #[serde(default)]
    pub(crate) arithmetic: String,
}

impl Identity {
    /// Returns the identity of the running program; `revision` comes from its build.
    pub fn of_program(revision: Option<&str>) -> Self {
        static PROGRAM: OnceLock<String> = OnceLock::new();
        static ARITHMETIC: OnceLock<String> = OnceLock::new();
        Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            revision: revision.unwrap_or("unknown").to_owned(),
            program: PROGRAM.get_or_init(program).clone(),
            arithmetic: ARITHMETIC.get_or_init(arithmetic::probe).clone(),
        }
    }

    /// Returns the identity of a library that another program has loaded, such as a module of Python: the library's
    /// file stands for the program.
    pub fn of_library(file: &Path, revision: Option<&str>) -> Self {
        Self {
            program: digest(File::open(file)),
            ..Self::of_program(revision)
        }
    }

    /// Differences between this and another; none if there is no difference.
    pub fn differs(&self, other: &Self) -> Option<String> {
        let fields = [
            ("version", &self.version, &other.version),
            ("git revision", &self.revision, &other.revision),
            ("program file (SHA-256)", &self.program, &other.program),
            (
                "arithmetic of the machine",
                &self.arithmetic,
                &other.arithmetic,
            ),
        ];
        let differing = fields.into_iter().filter(|(_, a, b)| a != b);
        let told: Vec<String> = differing
            .map(|(what, a, b)| format!("{what} {} there, {} here", short(a), short(b)))
            .collect();
        (!told.is_empty()).then(|| told.join("; "))
    }
}

impl fmt::Display for Identity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (revision, program) = (short(&self.revision), short(&self.program));
        write!(f, "{} ({revision}, program {program})", self.version)
    }
}

/// SHA-256 of the running program's file, or the reason why the file cannot be read: then nothing has this identity but
/// the same words.
fn program() -> String {
    // Linux has the file that runs here even if another has been put in its place since
    digest(File::open("/proc/self/exe").or_else(|_| File::open(std::env::current_exe()?)))
}

/// SHA-256 of a file, or the reason why the file cannot be read.
fn digest(file: std::io::Result<File>) -> String {
    let read = || {
        let mut hash = Sha256::new();
        std::io::copy(&mut file?, &mut hash)?;
        Ok::<_, std::io::Error>(hex(&hash.finalize()))
    };
    read().unwrap_or_else(|e| format!("unreadable: {e}"))
}

/// The first digits of a long hash; other words stay unchanged.
fn short(text: &str) -> String {
    let is_hash = |word: &str| word.len() >= 40 && word.bytes().all(|b| b.is_ascii_hexdigit());
    let parts: Vec<&str> = text.split('-').collect();
    let cut = parts.into_iter().map(|part| match is_hash(part) {
        true => part.get(..12).unwrap_or(part),
        false => part,
    });
    cut.collect::<Vec<_>>().join("-")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_differs_is_told_and_equal_programs_do_not() {
        let here = Identity::of_program(Some("0123456789abcdef0123456789abcdef01234567-dirty"));
        assert_eq!(here.program.len(), 64);
        assert_eq!(here.differs(&here.clone()), None);
        let there = Identity {
            revision: "fedcba9876543210fedcba9876543210fedcba98".into(),
            program: "0".repeat(64),
            ..here.clone()
        };
        let told = there.differs(&here).unwrap();
        assert!(
            told.contains("fedcba987654 there, 0123456789ab-dirty here"),
            "{told}"
        );
        assert!(
            told.contains("program file") && !told.contains("version"),
            "{told}"
        );
    }
}
