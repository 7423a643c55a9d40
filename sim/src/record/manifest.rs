//! `manifest.json`: what a run was made from. The same inputs give the same bytes: no clock, no absolute path.

use crate::error::Error;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::Path;

/// What a run was made from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Format version, 1.
    pub version: u32,
    /// Scenario name (file stem).
    pub scenario: String,
    /// Seed of the run.
    pub seed: u64,
    /// Version of monorig that made the run.
    pub monorig: String,
    /// SHA-256 of every file the run was made from, by name, as `sha256sum` prints it.
    pub inputs: BTreeMap<String, String>,
    /// SHA-256 over monorig's version, all inputs and the resolved scenario: runs with the same seed and the same hash are the same run.
    pub hash: String,
    /// The scenario with all defaults filled in.
    pub resolved: serde_json::Value,
}

impl Manifest {
    /// `inputs`: name (relative to the scenario's folder, so that it is the same on every machine) and contents of
    /// every file that was read; `resolved`: the scenario with all defaults filled in.
    pub fn new(
        scenario: &str,
        seed: u64,
        inputs: &BTreeMap<String, Vec<u8>>,
        resolved: serde_json::Value,
    ) -> Self {
        let monorig = env!("CARGO_PKG_VERSION").to_owned();
        let inputs: BTreeMap<String, String> = inputs
            .iter()
            .map(|(name, bytes)| (name.clone(), hex(&Sha256::digest(bytes))))
            .collect();
        let mut all = Sha256::new();
        all.update(format!("monorig {monorig}\n"));
        for (name, digest) in &inputs {
            all.update(format!("{digest}  {name}\n"));
        }
        // what `--set` changed is in no file
        all.update(resolved.to_string());
        Self {
            version: 1,
            scenario: scenario.into(),
            seed,
            monorig,
            inputs,
            hash: hex(&all.finalize()),
            resolved,
        }
    }

    /// The manifest as it stands in the file.
    pub fn to_json(&self) -> String {
        // Strings, numbers and JSON values: nothing in here can fail to serialise.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// Read a manifest back.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = crate::config::file::read_text(path)?;
        serde_json::from_str(&text).map_err(|e| {
            crate::config::file::input_error(
                path,
                "",
                e.to_string(),
                "a manifest.json that monorig wrote; run the scenario again",
            )
        })
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn manifest(seed: u64, track: &str) -> Manifest {
        let inputs = BTreeMap::from([
            ("hill.yaml".to_owned(), b"abc".to_vec()),
            (
                "../assets/tracks/hill.yaml".to_owned(),
                track.as_bytes().to_vec(),
            ),
        ]);
        Manifest::new("hill", seed, &inputs, serde_json::json!({"why": "test"}))
    }

    /// FIPS 180-2, appendix B.1: SHA-256 of "abc".
    #[test]
    fn hashes_are_those_of_sha256sum() {
        assert_eq!(
            manifest(1, "x").inputs["hill.yaml"],
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
        );
    }

    #[test]
    fn the_hash_follows_the_inputs_and_nothing_else() {
        assert_eq!(manifest(1, "x").to_json(), manifest(1, "x").to_json());
        assert_eq!(manifest(1, "x").hash, manifest(2, "x").hash);
        assert_ne!(manifest(1, "x").hash, manifest(1, "y").hash);
    }

    #[test]
    fn reads_back() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("manifest.json");
        let sent = manifest(1, "x");
        std::fs::write(&path, sent.to_json()).unwrap();
        assert_eq!(Manifest::read(&path).unwrap(), sent);
        std::fs::write(&path, "{").unwrap();
        assert!(matches!(Manifest::read(&path), Err(Error::Input(_))));
    }
}
