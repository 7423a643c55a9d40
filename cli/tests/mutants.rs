//! Every reader, given files that are almost right: an error or a result, never a panic, an abort, or seconds of
//! waiting.
//!
//! A few mutants of each kind in the normal suite; by hand as many as one likes: `MONORIG_MUTANTS=10000 cargo test
//! --release --test mutants`. `MONORIG_MUTANT_SEED` gives others.

#![allow(clippy::unwrap_used)]

mod common;

use common::TestFolder;
use monorig_testing::mutants::{self, mutant};
use std::process::{Command, Stdio};

/// Mutants of each kind in the normal suite.
const FEW: u64 = 150;
/// Files handed to a process at once.
const BATCH: u64 = 50;
/// Address space of a process, kB, and computing time, s.
const MEMORY_KB: u64 = 2_000_000;
const TIME_S: u64 = 5;

/// Runs monorig with so little memory and time; returns the exit code, none if it was killed, and its standard error.
fn bounded(dir: &TestFolder, arguments: &[String]) -> (Option<i32>, String) {
    let limits =
        format!("ulimit -v {MEMORY_KB}; ulimit -t {TIME_S}; ulimit -c 0; exec \"$0\" \"$@\"");
    let child = Command::new("bash")
        .args(["-c", &limits, env!("CARGO_BIN_EXE_monorig")])
        .args(arguments)
        .current_dir(dir.path(""))
        .env("NO_COLOR", "1")
        .stdin(Stdio::null())
        .output()
        .unwrap();
    (
        child.status.code(),
        String::from_utf8_lossy(&child.stderr).into_owned(),
    )
}

/// Hands mutants of `good` to monorig: `place` puts one into the folder and returns the file to be named, `command`
/// comes before the names.
fn attack(
    kind: &str,
    dir: &TestFolder,
    good: &[u8],
    command: &[&str],
    one_at_a_time: bool,
    place: impl Fn(u64, &[u8]) -> String,
) {
    let (all, first) = (mutants::count(FEW), mutants::first_seed());
    let command: Vec<String> = command.iter().map(|word| (*word).to_owned()).collect();
    let batch = if one_at_a_time { 1 } else { BATCH };
    for start in (0..all).step_by(batch as usize) {
        let seeds = start..(start + batch).min(all);
        let names: Vec<String> = seeds
            .map(|i| place(i % batch, &mutant(good, 0, first + i)))
            .collect();
        let fine = |names: &[String]| {
            let (code, told) = bounded(dir, &[&command[..], names].concat());
            let fine = matches!(code, Some(0..=2)) && !told.contains("panicked");
            (fine, format!("{code:?} {told}"))
        };
        if fine(&names).0 {
            continue;
        }
        // which of them? Together they may only have taken too long
        for (i, name) in names.iter().enumerate() {
            let (fine, told) = fine(std::slice::from_ref(name));
            let seed = start + i as u64;
            assert!(
                fine,
                "{kind}, mutant {seed}: {}",
                told.chars().take(2000).collect::<String>()
            );
        }
    }
}

/// Files that stand for themselves.
#[test]
fn mutants_of_input_files() {
    let dir = TestFolder::new();
    let asset = |name: &str| std::fs::read(common::project().join("assets").join(name)).unwrap();
    dir.write("study.yaml", STUDY.as_bytes());
    dir.write("tuning.yaml", TUNING.as_bytes());
    for (kind, good, folder) in [
        ("scenario", dir.read("scenario.yaml").into_bytes(), ""),
        ("track", dir.read("track.yaml").into_bytes(), ""),
        ("train", dir.read("train.yaml").into_bytes(), ""),
        ("sensors", dir.read("sensors.yaml").into_bytes(), ""),
        ("study", STUDY.as_bytes().to_vec(), ""),
        ("tuning", TUNING.as_bytes().to_vec(), ""),
        ("unit", asset("units/drive_unit.yaml"), "units/"),
        ("car", asset("road/hongqi_ehs3.yaml"), "road/"),
        ("rail-profile", asset("rails/i140e.yaml"), "rails/"),
        ("parameters", asset("tuned/dffrls_aekf_robust.yaml"), ""),
    ] {
        let place = |i: u64, bytes: &[u8]| {
            let name = format!("{folder}mutant_{i}.yaml");
            dir.write(&name, bytes);
            name
        };
        attack(kind, &dir, &good, &["check", "--kind", kind], false, place);
    }
}

/// Files that another one names: that one is checked, and leads to the mutant.
#[test]
fn mutants_of_files_that_others_name() {
    let dir = TestFolder::new();
    let survey = dir.read("survey.csv");
    attack(
        "survey",
        &dir,
        survey.as_bytes(),
        &["check", "--kind", "track"],
        false,
        |i, bytes| {
            let (csv, track) = (format!("mutant_{i}.csv"), format!("surveyed_{i}.yaml"));
            dir.write(&csv, bytes);
            dir.write(
                &track,
                dir.read("surveyed.yaml")
                    .replace("survey.csv", &csv)
                    .as_bytes(),
            );
            track
        },
    );
    let urdf = dir.read("units/cab.urdf");
    let unit = |i: u64, urdf: &str| {
        let (name, unit) = (format!("mutant_{i}.urdf"), format!("units/mutant_{i}.yaml"));
        dir.write(&format!("units/{name}"), urdf.as_bytes());
        dir.write(
            &unit,
            dir.read("units/cab.yaml")
                .replace("cab.urdf", &name)
                .as_bytes(),
        );
        unit
    };
    attack(
        "urdf",
        &dir,
        urdf.as_bytes(),
        &["check", "--kind", "unit"],
        false,
        |i, bytes| {
            let made = unit(i, "");
            dir.write(&format!("units/mutant_{i}.urdf"), bytes);
            made
        },
    );
    let mesh = std::fs::read(dir.path("units/meshes/cab_shell.stl")).unwrap();
    assert!(urdf.contains("meshes/cab_shell.stl"));
    attack(
        "stl",
        &dir,
        &mesh,
        &["check", "--kind", "unit"],
        false,
        |i, bytes| {
            let name = format!("meshes/mutant_{i}.stl");
            dir.write(&format!("units/{name}"), bytes);
            unit(i, &urdf.replace("meshes/cab_shell.stl", &name))
        },
    );
}

/// Files that monorig itself has written.
#[test]
fn mutants_of_results() {
    let dir = TestFolder::new();
    let (head, _) = common::GOOD.split_once("events:").unwrap();
    let quick = head
        .replace("after_s: 60", "after_s: 2")
        .replace("rapier", "point-mass");
    dir.write("quick.yaml", quick.as_bytes());
    let (code, _, told) = dir.monorig(&["run", "quick.yaml"]);
    assert!(matches!(code, Some(0 | 1)), "{told}");
    let run = "runs/quick/1";
    for name in ["channels.parquet", "metrics.json", "manifest.json"] {
        let good = std::fs::read(dir.path(&format!("{run}/{name}"))).unwrap();
        std::fs::create_dir_all(dir.path("alone")).unwrap();
        attack(name, &dir, &good, &["check"], false, |i, bytes| {
            let name = format!("alone/{i}_{name}");
            dir.write(&name, bytes);
            name
        });
    }
    dir.write("study.yaml", STUDY.as_bytes());
    let (code, _, told) = dir.monorig(&["study", "study.yaml"]);
    assert!(matches!(code, Some(0 | 1)), "{told}");
    let (code, _, told) = dir.monorig(&["test", "quick.yaml", "--json", "verdicts.json"]);
    assert!(matches!(code, Some(0 | 1)), "{told}");
    for name in ["runs/study/results.jsonl", "verdicts.json"] {
        let good = std::fs::read(dir.path(name)).unwrap();
        let place = |_, bytes: &[u8]| {
            dir.write("alone/results.jsonl", bytes);
            "alone/results.jsonl".to_owned()
        };
        attack(name, &dir, &good, &["report"], true, place);
        attack(
            name,
            &dir,
            &good,
            &["merge", "--into", "alone/all"],
            true,
            place,
        );
    }
}

const STUDY: &str = "\
version: 1
why: A spread.
scenario: scenario.yaml
runs: 3
set: {stop.after_s: 2, expect: [], events: [], physics.plant: point-mass, obstacles: []}
vary:
  - {path: load.mass_kg, uniform: [0, 2500]}
  - {path: sensors.wheel_speed.errors.bias, normal: {mean: 0, sd: 0.01}}
  - {path: estimators.dffrls_aekf_robust, choice: [{}, {lambda0: 0.9}]}
";

const TUNING: &str = "\
version: 1
why: A search.
estimator: dffrls_aekf_robust
parameters:
  lambda0: {from: 0.9, to: 0.999, scale: memory}
tuning: [{scenario: scenario.yaml, seeds: 1..2}]
validation: [{scenario: scenario.yaml, seeds: 3}]
objective: {metrics: [{metric: slope_rmse_deg}]}
evaluation: closed_loop
budget: 5
";
