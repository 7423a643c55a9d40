//! `monorig new estimator`: what it makes can be built with the versions of monorig, and is made whole or not at all.

use crate::common;
use crate::common::{TestFolder, project};
use monorig_testing::tools;
use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

/// Packages of a crate's lock file, each with its version and what it needs. The example has the versions of the
/// workspace (`tests/laws/locks.rs`).
fn packages(crate_folder: &Path) -> BTreeSet<String> {
    let lock = std::fs::read_to_string(crate_folder.join("Cargo.lock")).unwrap();
    let packages = lock.split("[[package]]").skip(1);
    packages.map(|p| p.trim().to_owned()).collect()
}

#[test]
fn a_crate_has_the_versions_of_the_workspace() {
    let dir = TestFolder::new();
    let sources = project().canonicalize().unwrap();
    let sources = sources.to_str().unwrap();
    std::fs::create_dir(dir.path("below")).unwrap();
    for name in ["my_filter", "a-filter"] {
        let folder = format!("below/{name}");
        let task = ["new", "estimator", "rust", &folder, "--monorig", sources];
        let (code, out, err) = dir.monorig(&task);
        assert_eq!((code, err.as_str()), (Some(0), ""), "{out}");
        assert!(out.lines().last().unwrap().starts_with("next: "), "{out}");
        let made = dir.path(&folder);
        let ours = packages(&project().join("examples/own_estimator"));
        assert!(ours.len() > 100, "{}", ours.len());
        let renamed = |p: &String| p.replace("\"own_estimator\"", &format!("\"{name}\""));
        assert_eq!(packages(&made), ours.iter().map(renamed).collect());
        // its scenario finds track, train and instruments; `mine` is known to its own program only
        let known = [
            "--set",
            "estimators={dffrls_aekf: {}}",
            "--set",
            "in_loop=dffrls_aekf",
        ];
        let climb = format!("{folder}/climb.yaml");
        let run = [
            "run",
            &climb,
            "--no-rerun",
            "--set",
            "expect=[]",
            "--set",
            "known_failures=[]",
        ];
        let (code, out, err) = dir.monorig(&[&run[..], &known].concat());
        assert!(matches!(code, Some(0 | 1)), "{out}{err}");
        assert!(
            !dir.read(&format!("{folder}/README.md"))
                .contains("own_estimator")
        );
    }
}

#[test]
fn nothing_is_made_of_a_mistake() {
    let dir = TestFolder::new();
    let sources = project().canonicalize().unwrap();
    let sources = sources.to_str().unwrap();
    let before = || -> BTreeSet<_> {
        let entries = std::fs::read_dir(dir.path("")).unwrap();
        entries.map(|e| e.unwrap().file_name()).collect()
    };
    dir.write("there", b"a file");
    let all = before();
    for (task, told) in [
        (&["there", "--monorig", sources][..], "exists already"),
        (
            &["2nd", "--monorig", sources],
            "is not a valid name of a crate",
        ),
        (
            &["mine", "--monorig", "units"],
            "has no examples/own_estimator",
        ),
        (
            &["mine"],
            "name the folder of monorig's sources with --monorig",
        ),
    ] {
        let (code, out, err) = dir.monorig(&[&["new-estimator", "rust"], task].concat());
        assert_eq!((code, out.as_str()), (Some(2), ""), "{task:?}");
        assert!(common::words(&err).contains(told), "{err}");
        assert_eq!(before(), all, "{task:?}");
    }
    assert_eq!(dir.read("there"), "a file");
}

/// A library that is made builds, and its scenario holds.
#[test]
#[cfg(unix)]
fn libraries_build_and_their_scenarios_hold() {
    let dir = TestFolder::new();
    let sources = project().canonicalize().unwrap();
    let sources = sources.to_str().unwrap();
    for language in ["c", "simulink", "python"] {
        let folder = format!("my_{language}_filter");
        let task = ["new-estimator", language, &folder, "--monorig", sources];
        let (code, out, err) = dir.monorig(&task);
        assert_eq!((code, err.as_str()), (Some(0), ""), "{out}");
        assert!(out.contains("the estimator `mine` is in "), "{out}");
        let (code, _, err) = dir.monorig(&task);
        assert_eq!(code, Some(2));
        assert!(err.contains("exists already"), "{err}");
        // pytest runs what is made in Python: it needs the package
        if language == "python" || !tools(&["make", "cc"]) {
            continue;
        }
        let make = dir.output(
            Command::new("make")
                .args(["-C", &folder])
                .stdout(std::process::Stdio::piped()),
        );
        assert_eq!(make.0, Some(0), "{make:?}");
        let (code, out, err) = dir.monorig(&["test", &format!("{folder}/climb.yaml")]);
        assert_eq!(code, Some(0), "{out}{err}");
    }
}

/// The example of an ECU in Python answers with the frames of this build.
#[test]
fn the_ecu_of_the_example_drives_the_train() {
    if !tools(&["python3"]) {
        eprintln!("skipped: no python3 here");
        return;
    }
    let scenario = project().join("examples/ecu/climb.yaml");
    let dir = TestFolder::new();
    let (code, out, err) = dir.monorig(&["test", scenario.to_str().unwrap(), "--seeds", "1"]);
    assert_eq!(code, Some(0), "{out}{err}");
}

/// A program with its `share` folder, as a wheel has it, needs no sources.
#[test]
#[cfg(unix)]
fn an_installed_program_finds_what_comes_with_it() {
    let dir = TestFolder::new();
    let share = dir.path("share/monorig");
    let copied = Command::new("python3")
        .arg(project().join("docs/tools/share.py"))
        .args([&share, &dir.path("libraries")])
        .status();
    if !copied.is_ok_and(|done| done.success()) {
        return;
    }
    std::fs::create_dir(dir.path("bin")).unwrap();
    let program = dir.path("bin/monorig");
    std::fs::copy(env!("CARGO_BIN_EXE_monorig"), &program).unwrap();
    std::fs::create_dir(dir.path("empty")).unwrap();
    let run = |words: &[&str]| {
        let mut command = Command::new(&program);
        let done = command.args(words).current_dir(dir.path("empty")).output();
        let done = done.unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (done.status.code(), text(&done.stdout), text(&done.stderr))
    };
    for named in ["minimal", "stress/no_stop", "scenarios/minimal.yaml"] {
        let (code, out, err) = run(&["run", named, "--no-rerun", "--set", "stop.after_s=1"]);
        assert!(matches!(code, Some(0 | 1)), "{named}: {out}{err}");
    }
    let (code, out, _) = run(&["list", "scenarios"]);
    assert!(
        code == Some(0) && out.starts_with("scenarios/adhesion_loss.yaml\n"),
        "{out}"
    );
    let (code, _, err) = run(&["run", "minimum"]);
    assert!(code == Some(2) && err.contains("minimum"), "{err}");
    for language in ["c", "simulink", "python", "rust"] {
        let (code, out, err) = run(&["new", "estimator", language, &format!("my_{language}")]);
        assert_eq!(code, Some(0), "{err}");
        assert_eq!(out.contains("crates.io"), language == "rust", "{out}");
    }
    let cargo = dir.read("empty/my_rust/Cargo.toml");
    let version = format!("version = \"{}\"", env!("CARGO_PKG_VERSION"));
    assert_eq!(cargo.matches(&version).count(), 3, "{cargo}");
    if tools(&["make", "cc"]) {
        let made = dir.output(Command::new("make").args(["-C", "empty/my_c"]));
        assert_eq!(made.0, Some(0), "{made:?}");
        let (code, out, err) = run(&["test", "my_c/climb.yaml"]);
        assert_eq!(code, Some(0), "{out}{err}");
    }
}

/// A new scenario runs as it is, says what each key is for, and is not written over another.
#[test]
fn a_new_scenario_runs_and_has_a_comment_at_each_key() {
    let dir = TestFolder::new();
    let sources = project().canonicalize().unwrap();
    let task = [
        "new",
        "scenario",
        "hill",
        "--monorig",
        sources.to_str().unwrap(),
    ];
    let (code, out, err) = dir.monorig(&task);
    assert_eq!((code, err.as_str()), (Some(0), ""), "{out}");
    assert!(out.ends_with("next: monorig run hill.yaml\n"), "{out}");
    let text = dir.read("hill.yaml");
    let lines: Vec<&str> = text.lines().collect();
    let keys = |l: &&&str| l.starts_with(|c: char| c.is_ascii_lowercase());
    assert!(lines.iter().filter(keys).count() > 7, "{text}");
    for two in lines.windows(2).filter(|two| keys(&&two[1])) {
        assert!(two[0].starts_with("# "), "{two:?}");
    }
    assert!(
        text.contains("# expect: ") && text.contains("# events: "),
        "{text}"
    );
    let (code, out, err) = dir.monorig(&["test", "hill.yaml"]);
    assert_eq!(code, Some(0), "{out}{err}");
    assert!(dir.refused(&task).contains("exists already"));
    assert_eq!(dir.read("hill.yaml"), text);
}
