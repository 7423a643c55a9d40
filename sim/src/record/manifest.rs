//! `manifest.json`: what a run was made from and by, and what its other files must be. The same inputs and the same
//! program give the same bytes: no clock, no absolute path.

use super::folder::is_name;
use super::identity::Identity;
use crate::config::file::{input_error, read_result, regular};
use crate::config::input_files::{hex, note_input};
use crate::error::{Error, wrong};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

/// Name of the file in the folder of a run.
pub const NAME: &str = "manifest.json";
/// Name of the file of a run's metrics.
const METRICS: &str = "metrics.json";
/// Format version.
const VERSION: u32 = 2;

/// Run to which metrics belong.
#[derive(Deserialize)]
struct Of {
    scenario: String,
    seed: u64,
}

/// Sources and program of a run, and the check sums of its other files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Format version, 2.
    pub(crate) version: u32,
    /// Scenario name (file stem); of a variant `NAME@VARIANT`.
    pub scenario: String,
    /// Seed of the run.
    pub seed: u64,
    /// Changes to the scenario file, as `path=value`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub changes: Vec<String>,
    /// The program that made the run.
    pub monorig: Identity,
    /// SHA-256 of every input file of the run, by name relative to the scenario's folder, as `sha256sum` prints it.
    pub inputs: BTreeMap<String, String>,
    /// SHA-256 over program, inputs and resolved scenario: runs with the same seed and the same hash are the same run.
    pub hash: String,
    /// SHA-256 of every other file of the run, by name.
    pub outputs: BTreeMap<String, String>,
    /// Scenario with all defaults, including the default parameters of estimators and controller.
    pub resolved: serde_json::Value,
}

/// SHA-256 over everything that determines a result: the program, the input files and what `--set` and defaults made of
/// them.
pub fn hash(
    monorig: &Identity,
    inputs: &BTreeMap<String, String>,
    resolved: &serde_json::Value,
) -> String {
    let mut all = Sha256::new();
    let Identity {
        version,
        revision,
        program,
        arithmetic,
    } = monorig;
    all.update(format!(
        "monorig {version} {revision} {program} {arithmetic}\n"
    ));
    for (name, digest) in inputs {
        all.update(format!("{digest}  {name}\n"));
    }
    // what `--set` changed is in no file
    all.update(resolved.to_string());
    hex(&all.finalize())
}

impl Manifest {
    /// `inputs`: SHA-256 of every file that was read, by name relative to the scenario's folder, so that it is the same
    /// on every machine; `resolved`: the scenario with all defaults filled in.
    pub fn new(
        monorig: &Identity,
        scenario: &str,
        seed: u64,
        inputs: BTreeMap<String, String>,
        resolved: serde_json::Value,
    ) -> Self {
        Self {
            version: VERSION,
            scenario: scenario.into(),
            seed,
            changes: Vec::new(),
            monorig: monorig.clone(),
            hash: hash(monorig, &inputs, &resolved),
            inputs,
            outputs: BTreeMap::new(),
            resolved,
        }
    }

    /// Computes the check sums of all files in the folder of the run except the manifest.
    pub fn sum_outputs(&mut self, folder: &Path) -> Result<(), Error> {
        let failed = Error::at(folder);
        for entry in std::fs::read_dir(folder).map_err(&failed)? {
            let entry = entry.map_err(&failed)?;
            let name = entry.file_name().to_string_lossy().into_owned();
            if name != NAME && entry.path().is_file() {
                self.outputs.insert(name, sum(&entry.path())?);
            }
        }
        Ok(())
    }

    /// Check a file of the run against its check sum.
    pub fn verify(&self, folder: &Path, name: &str) -> Result<(), Error> {
        let path = folder.join(name);
        let Some(wanted) = self.outputs.get(name) else {
            return Err(damaged(
                &path,
                "the manifest in this folder does not list this file",
            ));
        };
        if !path.is_file() {
            return Err(damaged(
                &path,
                "the manifest lists this file, but the file is missing",
            ));
        }
        match sum(&path)? == *wanted {
            true => Ok(()),
            false => Err(damaged(
                &path,
                "this file was changed after the run: its check sum differs from manifest.json",
            )),
        }
    }

    /// The manifest as in the file.
    pub fn to_json(&self) -> String {
        // Strings, numbers and JSON values: nothing in here can fail to serialise.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// Read a manifest back.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = read_result(path)?;
        let refused = |message: String| {
            let help = "use a manifest.json of this version of monorig; run the scenario again";
            input_error(path, "", message, help)
        };
        let found: Self = serde_json::from_str(&text).map_err(|e| refused(e.to_string()))?;
        if found.version != VERSION {
            return Err(refused(format!(
                "this manifest has format version {}",
                found.version
            )));
        }
        // names become paths: one that leads elsewhere is none
        let names = std::iter::once(&found.scenario).chain(found.outputs.keys());
        if let Some(name) = names.into_iter().find(|name| !is_name(name)) {
            return Err(refused(format!(
                "{name:?} cannot be the name of a run or of its file"
            )));
        }
        if hash(&found.monorig, &found.inputs, &found.resolved) != found.hash {
            let message =
                "this manifest was edited: its hash does not fit its program, inputs and scenario";
            return Err(refused(message.to_owned()));
        }
        Ok(found)
    }

    /// Reads the manifest in the folder of a run, and compares it with the metrics in this folder: these must be as the
    /// run left them, and of the same scenario and seed.
    pub fn of_run(folder: &Path) -> Result<Self, Error> {
        let manifest = Self::read(&folder.join(NAME))?;
        let files = manifest.outputs.keys();
        files.for_each(|name| note_input(&folder.join(name)));
        manifest.verify(folder, METRICS)?;
        let path = folder.join(METRICS);
        let of: Of = serde_json::from_str(&read_result(&path)?)
            .map_err(|_| damaged(&path, "these are not the metrics of a run"))?;
        match of.scenario == manifest.scenario && of.seed == manifest.seed {
            true => Ok(manifest),
            false => Err(damaged(
                &folder.join(NAME),
                &format!(
                    "this manifest is of {} seed {}, but the metrics in this folder are of {} seed {}",
                    manifest.scenario, manifest.seed, of.scenario, of.seed
                ),
            )),
        }
    }
}

/// SHA-256 of a file, as `sha256sum` prints it.
pub fn sum(path: &Path) -> Result<String, Error> {
    regular(path)?;
    let mut hash = Sha256::new();
    let file = File::open(path);
    file.and_then(|mut file| std::io::copy(&mut file, &mut hash))
        .map_err(Error::at(path))?;
    Ok(hex(&hash.finalize()))
}

fn damaged(path: &Path, message: &str) -> Error {
    wrong(
        path,
        None,
        message,
        "make the result again with `monorig run`",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::input_files::sha256;

    fn manifest(seed: u64, track: &str) -> Manifest {
        let inputs = BTreeMap::from([
            ("hill.yaml".to_owned(), sha256(b"abc")),
            (
                "../assets/tracks/hill.yaml".to_owned(),
                sha256(track.as_bytes()),
            ),
        ]);
        let resolved = serde_json::json!({"why": "test"});
        Manifest::new(&Identity::of_program(None), "hill", seed, inputs, resolved)
    }

    /// FIPS 180-2, appendix B.1: SHA-256 of "abc".
    #[test]
    fn hashes_are_those_of_sha256sum() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("abc");
        std::fs::write(&path, "abc").unwrap();
        let abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(manifest(1, "x").inputs["hill.yaml"], abc);
        assert_eq!(sum(&path).unwrap(), abc);
    }

    #[test]
    fn the_hash_follows_inputs_and_program_and_nothing_else() {
        assert_eq!(manifest(1, "x").to_json(), manifest(1, "x").to_json());
        assert_eq!(manifest(1, "x").hash, manifest(2, "x").hash);
        assert_ne!(manifest(1, "x").hash, manifest(1, "y").hash);
        let m = manifest(1, "x");
        for other in [
            Identity {
                revision: "other".into(),
                ..m.monorig.clone()
            },
            Identity {
                program: "other".into(),
                ..m.monorig.clone()
            },
            Identity {
                arithmetic: "other".into(),
                ..m.monorig.clone()
            },
        ] {
            assert_ne!(hash(&other, &m.inputs, &m.resolved), m.hash);
        }
    }

    #[test]
    fn a_changed_or_missing_output_is_found() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("channels.parquet");
        std::fs::write(&path, "abc").unwrap();
        let mut m = manifest(1, "x");
        m.sum_outputs(dir.path()).unwrap();
        let name = "channels.parquet";
        m.verify(dir.path(), name).unwrap();
        std::fs::write(&path, "abd").unwrap();
        assert!(
            m.verify(dir.path(), name)
                .unwrap_err()
                .to_string()
                .contains("check sum")
        );
        std::fs::remove_file(&path).unwrap();
        assert!(
            m.verify(dir.path(), name)
                .unwrap_err()
                .to_string()
                .contains("missing")
        );
    }

    #[test]
    fn reads_back() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("manifest.json");
        let sent = manifest(1, "x");
        std::fs::write(&path, sent.to_json()).unwrap();
        assert_eq!(Manifest::read(&path).unwrap(), sent);
        let named = |scenario: &str| Manifest {
            scenario: scenario.into(),
            ..sent.clone()
        };
        let with_output = |name: &str| Manifest {
            outputs: [(name.to_owned(), String::new())].into(),
            ..sent.clone()
        };
        for bad in [
            "{".to_owned(),
            sent.to_json().replace("\"version\": 2", "\"version\": 1"),
            sent.to_json()
                .replace("\"why\": \"test\"", "\"why\": \"text\""),
            named("../x").to_json(),
            named("/tmp/x").to_json(),
            named("a/b").to_json(),
            named("..").to_json(),
            named("").to_json(),
            named("a\u{1b}[2J").to_json(),
            with_output("../../etc/passwd").to_json(),
        ] {
            std::fs::write(&path, bad).unwrap();
            assert!(matches!(Manifest::read(&path), Err(Error::Input(_))));
        }
    }
}
