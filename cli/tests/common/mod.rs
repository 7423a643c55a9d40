//! A folder with a good scenario in it, and the real binary run there.

#![allow(dead_code)] // every test file is a program of its own and uses part of this
#![allow(clippy::unwrap_used)] // a helper of tests

use std::path::Path;
use std::process::{Command, Stdio};

/// A scenario that uses every part of the format.
pub const GOOD: &str = "\
version: 1
why: A sample.
track: track.yaml
train: train.yaml
load: {mass_kg: 2500}
start: {chainage_m: 25, speed_mps: 0}
stop: {after_s: 60}
physics: {dt_ms: 2, plant: rapier}
drive:
  speed: [{at_s: 0, mps: 0}, {at_s: 4, mps: 1.0}]
  controller: {kp: 1.5, ki: 0.5, feedforward: estimate, hold: true}
sensors: sensors.yaml
estimators:
  dffrls_aekf: {lambda0: 0.98}
in_loop: dffrls_aekf
events:
  - {at_s: 30, load_mass_kg: 5000}
  - {from_m: 80, to_m: 95, adhesion: 0.12}
  - {from_s: 40, to_s: 43, sensor: imu, fault: stuck}
surroundings: [{at_m: 50, left_m: 2, up_m: -1, size_m: [1, 1, 1]}]
seeds: 1..10
record: {rate_hz: 50}
expect:
  - {estimator: dffrls_aekf, metric: mass_error_rel_max, after_s: 10, at_most: 0.032}
";

/// The folder; gone when dropped.
pub struct Rig(tempfile::TempDir);

impl Rig {
    /// With the good scenario and the files it names.
    pub fn new() -> Self {
        let rig = Self(tempfile::tempdir().unwrap());
        rig.write("scenario.yaml", GOOD.as_bytes());
        for name in ["track.yaml", "train.yaml", "sensors.yaml"] {
            rig.write(name, b"version: 1\n");
        }
        rig
    }

    /// Write a file.
    pub fn write(&self, name: &str, bytes: &[u8]) {
        std::fs::write(self.0.path().join(name), bytes).unwrap();
    }

    /// Make a link to itself: a file even root cannot read.
    pub fn circle(&self, name: &str) {
        std::os::unix::fs::symlink(name, self.0.path().join(name)).unwrap();
    }

    /// Run monorig in the folder: exit code, standard output, standard error.
    pub fn monorig(&self, arguments: &[&str]) -> (Option<i32>, String, String) {
        self.monorig_to(arguments, Stdio::piped())
    }

    /// The same with standard output somewhere else.
    pub fn monorig_to(&self, arguments: &[&str], out: Stdio) -> (Option<i32>, String, String) {
        let output = Command::new(env!("CARGO_BIN_EXE_monorig"))
            .args(arguments)
            .current_dir(self.0.path())
            .env("NO_COLOR", "1")
            .env_remove("CLICOLOR_FORCE")
            .env("COLUMNS", "100")
            .stdin(Stdio::null())
            .stdout(out)
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
            .wait_with_output()
            .unwrap();
        (
            output.status.code(),
            self.plain(&output.stdout),
            self.plain(&output.stderr),
        )
    }

    /// What monorig says when it refuses: code 2, no panic, nothing left behind.
    pub fn refused(&self, arguments: &[&str]) -> String {
        let before = self.names();
        let (code, out, err) = self.monorig(arguments);
        assert_eq!(code, Some(2), "{arguments:?}\n{out}{err}");
        assert!(!err.contains("panicked"), "{err}");
        assert_eq!(self.names(), before, "something was left behind");
        assert!(!err.is_empty());
        format!("{out}{err}")
    }

    fn names(&self) -> Vec<String> {
        let mut names = Vec::new();
        list(self.0.path(), &mut names);
        names.sort();
        names
    }

    fn plain(&self, bytes: &[u8]) -> String {
        let text = String::from_utf8(bytes.to_vec()).unwrap();
        text.replace(&self.0.path().display().to_string(), "FOLDER")
    }
}

fn list(folder: &Path, names: &mut Vec<String>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let entry = entry.unwrap();
        names.push(entry.path().display().to_string());
        if entry.file_type().unwrap().is_dir() {
            list(&entry.path(), names);
        }
    }
}
