//! Which crates are built: without the feature `viewer`, and to test the physics, none of Rerun's; with it its SDK
//! alone.

use std::process::Command;

fn crates(package: &str, more: &[&str]) -> Vec<String> {
    let tree = Command::new(env!("CARGO"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(["tree", "--locked", "--offline", "--package", package])
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
    let with = crates("monorig", &[]);
    assert!(with.iter().any(|name| of_rerun(name)), "{with:?}");
    for part in [
        "rerun",
        "re_analytics",
        "re_auth",
        "re_entity_db",
        "re_viewer",
    ] {
        assert!(!with.iter().any(|name| name == part), "{part}");
    }
    let without = crates("monorig", &["--no-default-features"]);
    assert!(without.iter().any(|name| name == "monorig-sim"));
    let left: Vec<&String> = without.iter().filter(|name| of_rerun(name)).collect();
    assert!(left.is_empty(), "{left:?}");
}

/// The Python module is no default member: it is built for a wheel alone.
const PYTHON: &str = "monorig-python";

/// The same crates with the same features whether the program is built alone, with the workspace or for tests: Rerun is
/// built once.
#[test]
fn one_set_of_features_however_it_is_built() {
    let with_features = |more: &[&str]| {
        let tree = Command::new(env!("CARGO"))
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .args([
                "tree",
                "--locked",
                "--offline",
                "--prefix",
                "none",
                "--format",
                "{p} {f}",
            ])
            .args(more)
            .output()
            .unwrap();
        assert!(tree.status.success());
        let text = String::from_utf8(tree.stdout).unwrap();
        let lines = text.lines().map(|l| l.trim_end_matches(" (*)").to_owned());
        // `testing` of monorig-sim holds a few functions for tests
        let lines = lines.filter(|l| !l.starts_with("monorig-sim "));
        lines.collect::<std::collections::BTreeSet<String>>()
    };
    let alone = with_features(&["--package", "monorig", "--edges", "normal,build"]);
    assert!(alone.iter().any(|l| l.starts_with("re_sdk ")));
    for more in [
        &[
            "--workspace",
            "--exclude",
            PYTHON,
            "--edges",
            "normal,build",
        ][..],
        &[
            "--workspace",
            "--exclude",
            PYTHON,
            "--edges",
            "normal,build,dev",
        ],
    ] {
        let all = with_features(more);
        let other: Vec<&String> = alone.difference(&all).collect();
        assert!(
            other.is_empty(),
            "built again for the workspace: {other:#?}"
        );
    }
}

/// The laws of the physics and the events are tested by a package of which Rerun is no part, its benches included.
#[test]
fn the_physics_is_tested_without_the_viewer() {
    let all = crates("monorig-tests", &["--edges", "normal,build,dev"]);
    assert!(all.iter().any(|name| name == "monorig-lab"));
    let left: Vec<&String> = all.iter().filter(|name| of_rerun(name)).collect();
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
