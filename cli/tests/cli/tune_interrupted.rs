//! `monorig tune`, stopped by Ctrl-C: what it says is kept is there, and goes on with `--resume`.

use crate::common::TestFolder;
use monorig_testing::tools;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Closed loop: every trial takes long, so there is time to stop it.
const STUDY: &str = "\
version: 1
why: A sample.
estimator: dffrls_aekf_robust
parameters:
  delta: {from: 0.9, to: 0.9999, scale: memory}
tuning: [{scenario: scenario.yaml, set: {stop.after_s: 30, events: [], expect: [], drive.controller.feedforward: none}, seeds: 1..2}]
validation: [{scenario: scenario.yaml, set: {stop.after_s: 30, events: [], expect: [], drive.controller.feedforward: none}, seeds: [7]}]
objective: {metrics: [{metric: mass_rmse_kg, after_s: 20}]}
evaluation: EVALUATION
budget: 1000
";

fn start(dir: &TestFolder, evaluation: &str) -> Child {
    dir.write(
        "study.yaml",
        STUDY.replace("EVALUATION", evaluation).as_bytes(),
    );
    Command::new(env!("CARGO_BIN_EXE_monorig"))
        .args(["tune", "study.yaml", "--out", "out", "--jobs", "1"])
        .current_dir(dir.path(""))
        .env("NO_COLOR", "1")
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Ctrl-C as soon as something is so; what it said then.
fn interrupted_when(mut child: Child, so: impl Fn() -> bool) -> String {
    let begun = Instant::now();
    while !so() {
        let goes_on = child.try_wait().unwrap().is_none() && begun.elapsed().as_secs() < 120;
        assert!(goes_on, "it never came: {child:?}");
        std::thread::sleep(Duration::from_millis(2));
    }
    let pid = child.id().to_string();
    let sent = Command::new("kill").args(["-INT", &pid]).status().unwrap();
    assert!(sent.success());
    let ended = child.wait_with_output().unwrap();
    let told = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert_eq!(ended.status.code(), Some(2), "{told}");
    told
}

fn lines(path: &Path) -> usize {
    std::fs::read_to_string(path).map_or(0, |text| text.lines().count())
}

/// While the runs are recorded there is no trial, and none is said to be kept.
#[test]
fn without_trials_none_are_said_to_be_kept() {
    if !tools(&["kill"]) {
        return;
    }
    let dir = TestFolder::new();
    let child = start(&dir, "replay");
    let told = interrupted_when(child, || dir.path("out/tune/.cache").is_dir());
    assert!(
        told.contains("interrupted: there are no trials yet"),
        "{told}"
    );
    assert!(
        !told.contains("kept") && !told.contains("--resume"),
        "{told}"
    );
    assert_eq!(lines(&dir.path("out/tune/study/trials.jsonl")), 0);
}

/// As many as are said to be kept are in the file, one a line behind its header.
#[test]
fn the_trials_that_are_said_to_be_kept_are_there() {
    if !tools(&["kill"]) {
        return;
    }
    let dir = TestFolder::new();
    let store = dir.path("out/tune/study/trials.jsonl");
    let told = interrupted_when(start(&dir, "closed_loop"), || lines(&store) >= 3);
    let kept = lines(&store) - 1;
    assert!(
        told.contains(&format!("interrupted: {kept} trials are kept")),
        "{told}"
    );
    assert!(told.contains("--resume"), "{told}");
}
