//! Every reader, given files that are almost right: an error or a result, never a panic, an abort, or seconds of
//! waiting.
//!
//! A few mutants of each kind in the normal suite; by hand as many as one likes: `MONORIG_MUTANTS=10000 cargo test
//! --release mutants::`. `MONORIG_MUTANT_SEED` gives others.

use crate::common;
use crate::common::TestFolder;
use monorig_testing::Random;
use monorig_testing::mutants::{self, mutant};
use monorig_testing::tools;
use std::process::{Command, Stdio};

/// Mutants of each kind in the normal suite.
const FEW: u64 = 150;
/// Files handed to a process at once.
const BATCH: u64 = 50;
/// Address space of a process, kB, its computing time, s, and its time by the clock on a machine that does much else,
/// s.
const MEMORY_KB: u64 = 1_000_000;
const TIME_S: u64 = 5;
const CLOCK_S: u64 = 60;

/// Runs monorig with so little memory and time; returns the exit code, none if it was killed, and its standard error.
fn bounded(dir: &TestFolder, arguments: &[String]) -> (Option<i32>, String) {
    let limits = format!(
        "ulimit -v {MEMORY_KB}; ulimit -t {TIME_S}; ulimit -c 0; exec timeout {CLOCK_S} \"$0\" \"$@\""
    );
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
    if !tools(&["bash", "timeout"]) {
        return;
    }
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
    if !tools(&["bash", "timeout"]) {
        return;
    }
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
    if !tools(&["bash", "timeout"]) {
        return;
    }
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

/// A scenario of three seconds with every file of its own, whose numbers are all small and plain.
const SHORT: &str = "\
version: 1
why: A short one.
track: track.yaml
train: train.yaml
load: {mass_kg: 2500}
start: {chainage_m: 25, speed_mps: 0.5}
stop: {after_s: 3}
physics: {dt_ms: 2, gravity_mps2: 9.81}
drive:
  speed: [{at_s: 0, mps: 0.5}, {at_s: 2, mps: 1.0}]
  controller: {kp: 1.5, ki: 0.5}
sensors: sensors.yaml
estimators:
  dffrls_aekf_robust: {lambda0: 0.98}
  rail_fusion: {}
record: {rate_hz: 50}
expect:
  - {estimator: rail_fusion, metric: slope_rmse_deg, after_s: 1, until_s: 2.5, at_most: 3, quantile: 0.5, availability: 0.5}
integrity: {k: 3, mass_alert_rel: 0.1, slope_alert_deg: 1, max_misleading_share: 0.001}
";

/// Every number of every file, with a value that no physics has: the run ends in time with a result or with an error
/// that says what is wrong, and `test` writes its reports whatever it finds.
#[test]
fn extreme_values_of_every_leaf() {
    if !tools(&["bash", "timeout"]) {
        return;
    }
    const SIZES: [f64; 16] = [
        1e-320, 1e-31, 1e-15, 1e-6, 1e-3, 0.5, 1.5, 10.0, 1e3, 1e5, 1e6, 1e8, 1e9, 1e11, 1e12,
        1e300,
    ];
    let dir = TestFolder::new();
    dir.write("short.yaml", SHORT.as_bytes());
    let files = [
        "short.yaml",
        "train.yaml",
        "track.yaml",
        "sensors.yaml",
        "units/drive_unit.yaml",
        "units/load_block.yaml",
    ];
    let good: Vec<String> = files.iter().map(|file| dir.read(file)).collect();
    let mut random = Random::new(mutants::first_seed());
    for case in 0..mutants::count(FEW / 5) {
        let at = random.below(files.len());
        let (file, text) = (files[at], &good[at]);
        let numbers = numbers(text);
        let (from, to) = numbers[random.below(numbers.len())];
        let size = *random.of(&SIZES);
        let value = match random.below(5) {
            0 => "0".to_owned(),
            1 => format!("{:e}", -size),
            _ => format!("{size:e}"),
        };
        let (before, after) = (&text[..from], &text[to..]);
        dir.write(file, format!("{before}{value}{after}").as_bytes());
        let command = [
            "test",
            "short.yaml",
            "--json",
            "v.json",
            "--junit",
            "v.xml",
            "--jobs",
            "1",
        ];
        let (code, told) = bounded(&dir, &command.map(str::to_owned));
        let words = format!(
            "case {case}, {file}: {} -> {value}: {code:?} {told}",
            &text[from..to]
        );
        assert!(
            matches!(code, Some(0..=2)) && !told.contains("panicked"),
            "{words}"
        );
        for report in ["v.json", "v.xml"] {
            assert!(dir.path(report).is_file(), "{words}: no {report}");
        }
        dir.write(file, text.as_bytes());
    }
}

/// The places of the numbers in a text: behind a colon, a comma, a bracket or a blank.
fn numbers(text: &str) -> Vec<(usize, usize)> {
    let bytes = text.as_bytes();
    let is_number = |b: &u8| b.is_ascii_digit() || b".eE+-".contains(b);
    let mut found = Vec::new();
    let mut at = 0;
    while let Some(start) = bytes[at..]
        .iter()
        .position(|b| b.is_ascii_digit() || *b == b'-')
    {
        let from = at + start;
        let length = bytes[from..].iter().take_while(|b| is_number(b)).count();
        let before = from.checked_sub(1).map_or(b' ', |i| bytes[i]);
        let behind = bytes.get(from + length).copied().unwrap_or(b' ');
        let alone = b" [,".contains(&before) && b" ],}\n".contains(&behind);
        if alone && text[from..from + length].parse::<f64>().is_ok() {
            found.push((from, from + length));
        }
        at = from + length.max(1);
    }
    found
}
