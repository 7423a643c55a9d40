//! Without the feature `viewer` no crate of Rerun's is built.

#![allow(clippy::unwrap_used)]

use std::process::Command;

fn crates(more: &[&str]) -> Vec<String> {
    let tree = Command::new(env!("CARGO"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(["tree", "--locked", "--package", "monorig"])
        .args(["--edges", "normal,build", "--prefix", "none"])
        .args(more)
        .output()
        .unwrap();
    assert!(
        tree.status.success(),
        "{}",
        String::from_utf8_lossy(&tree.stderr)
    );
    let text = String::from_utf8(tree.stdout).unwrap();
    let names = text.lines().filter_map(|l| l.split_whitespace().next());
    names.map(str::to_owned).collect()
}

fn of_rerun(name: &str) -> bool {
    name.starts_with("re_") || name == "rerun" || name == "monorig-viz"
}

#[test]
fn the_viewer_is_a_feature() {
    let with = crates(&[]);
    assert!(with.iter().any(|name| of_rerun(name)), "{with:?}");
    let without = crates(&["--no-default-features"]);
    assert!(without.iter().any(|name| name == "monorig-sim"));
    let left: Vec<&String> = without.iter().filter(|name| of_rerun(name)).collect();
    assert!(left.is_empty(), "{left:?}");
}

/// Run, and read back what it left: only in a program built without the viewer.
#[cfg(not(feature = "viewer"))]
#[test]
fn a_program_without_the_viewer_says_so_once() {
    let out = tempfile::tempdir().unwrap();
    let monorig = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_monorig"));
        command.current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
        let done = command.args(arguments).output().unwrap();
        let told = String::from_utf8(done.stderr).unwrap();
        (done.status.code(), told)
    };
    let folder = out.path().to_str().unwrap();
    let (code, told) = monorig(&["run", "scenarios/minimal.yaml", "--out", folder]);
    assert_eq!(code, Some(0), "{told}");
    assert_eq!(told.matches("run.rrd is not written").count(), 1, "{told}");
    let recording = out.path().join("minimal/1/run.rrd");
    assert!(!recording.exists());
    std::fs::write(&recording, b"RRF2").unwrap();
    let (code, told) = monorig(&["check", recording.to_str().unwrap()]);
    assert_eq!(code, Some(2));
    assert!(told.contains("built without the viewer"), "{told}");
}
