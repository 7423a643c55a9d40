//! `monorig study` and `monorig merge`: the same bytes whatever happens on the way.

use crate::common::TestFolder;
use std::process::{Command, Stdio};
use std::time::Duration;

/// A quick scenario.
const QUICK: &str = "\
version: 1
why: A quick one.
track: track.yaml
train: train.yaml
start: {chainage_m: 2}
stop: {after_s: 20}
physics: {plant: point-mass}
drive: {speed: [{at_s: 0, mps: 0}, {at_s: 3, mps: 1.5}]}
sensors: sensors.yaml
estimators: {rail_fusion: {}, dffrls_aekf_robust: {}}
expect:
  - {metric: speed_rmse_mps, at_most: 1}
  - {estimator: rail_fusion, metric: mass_availability, at_least: 0}
  - {estimator: dffrls_aekf_robust, metric: mass_availability, at_least: 0}
integrity: {max_misleading_share: 1}
";

/// Everything that can vary: numbers of the scenario, of the files it names, whole entries.
const STUDY: &str = "\
version: 1
why: A spread.
scenario: quick.yaml
runs: 200
first_seed: 11
set: {record.rate_hz: 10}
vary:
  - {path: load.mass_kg, uniform: [0, 2500]}
  - {path: train.resistance.running_wheel, lognormal: {median: 0.02, sd_of_log: 0.2, max: 0.05}}
  - {path: 'sensors.wheel_speed.errors.bias', normal: {mean: 0, sd: 0.01}}
  - {path: 'track.vertical[1].to_grade_deg', uniform: [6, 10]}
  - {path: sensors.gyro.sampling.dropout, also: [sensors.wheel_speed.sampling.dropout], uniform: [0, 0.02]}
  - {path: estimators.rail_fusion, choice: [{}]}
";

fn dir(study: &str) -> TestFolder {
    let dir = TestFolder::new();
    dir.write("quick.yaml", QUICK.as_bytes());
    dir.write("spread.yaml", study.as_bytes());
    dir
}

const RESULTS: &str = "runs/spread/results.jsonl";

fn merge<'a>(parts: &[&'a str]) -> Vec<&'a str> {
    [&["merge", "--into", "all.jsonl"], parts].concat()
}

/// Whatever the number of threads, in shards or whole.
#[test]
fn threads_and_shards_change_no_byte() {
    let dir = dir(&STUDY.replace("runs: 200", "runs: 23"));
    let run = |arguments: &[&str]| {
        let (code, out, err) = dir.monorig(&[&["study", "spread.yaml"], arguments].concat());
        assert_eq!(code, Some(0), "{out}{err}");
        out
    };
    let told = run(&["--jobs", "1", "--out", "one"]);
    assert!(told.ends_with(": all 12 checks, 23 runs\n"), "{told}");
    let two = run(&["--jobs", "2", "--out", "two"]);
    assert_eq!(two.replace("two/spread", "one/spread"), told);
    let whole = dir.read("one/spread/results.jsonl");
    assert_eq!(whole.lines().count(), 24);
    assert!(dir.read("two/spread/results.jsonl") == whole);

    let mut parts = Vec::new();
    for shard in ["3/4", "1/4", "4/4", "2/4"] {
        run(&["--shard", shard]);
        parts.push(format!(
            "runs/spread/results.{}.jsonl",
            shard.replace('/', "-of-")
        ));
    }
    let parts: Vec<&str> = parts.iter().map(String::as_str).collect();
    let told = dir.refused(&merge(&parts[..3]));
    assert!(
        told.contains("do not make a whole: 1/4, 3/4, 4/4"),
        "{told}"
    );
    let (code, _, err) = dir.monorig(&merge(&parts));
    assert_eq!(code, Some(0), "{err}");
    assert!(dir.read("all.jsonl") == whole);

    let torn = dir.read(parts[0]);
    dir.write(parts[0], &torn.as_bytes()[..torn.len() - 5]);
    let told = dir.refused(&merge(&parts));
    assert!(
        told.contains("is not the result of run") && told.contains("it continues"),
        "{told}"
    );
}

/// Killed again and again without warning, it comes to the same bytes as an undisturbed study.
#[test]
fn killed_at_any_moment_it_goes_on_to_the_same_bytes() {
    let dir = dir(&STUDY.replace("runs: 200", "runs: 60"));
    let (code, _, err) = dir.monorig(&["study", "spread.yaml", "--out", "undisturbed"]);
    assert_eq!(code, Some(0), "{err}");
    let whole = dir.read("undisturbed/spread/results.jsonl");
    let mut kills = 0;
    for wait_ms in [30, 47, 111, 65, 150, 38, 95, 200, 71] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_monorig"))
            .args(["study", "spread.yaml"])
            .current_dir(dir.path(""))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(wait_ms));
        child.kill().unwrap(); // SIGKILL
        kills += usize::from(!child.wait().unwrap().success());
        // what stands there is the beginning of the whole, to the byte
        let so_far = std::fs::read(dir.path(RESULTS)).unwrap_or_default();
        assert!(whole.as_bytes().starts_with(&so_far));
    }
    assert!(
        kills > 0,
        "every run of it was over before it could be killed"
    );
    let (code, _, err) = dir.monorig(&["study", "spread.yaml"]);
    assert_eq!(code, Some(0), "{err}");
    assert!(dir.read(RESULTS) == whole);
}

/// Another study, or another track, does not go on with old results.
#[test]
fn a_changed_study_does_not_go_on_with_old_results() {
    let short = STUDY.replace("runs: 200", "runs: 3");
    let dir = dir(&short);
    assert_eq!(dir.monorig(&["study", "spread.yaml"]).0, Some(0));
    let before = dir.read(RESULTS);
    let track = dir.read("track.yaml");
    for (file, text, what) in [
        (
            "spread.yaml",
            short.replace("[0, 2500]", "[0, 2000]"),
            "spread.yaml has changed; first_run.load.mass_kg ",
        ),
        (
            "track.yaml",
            track.replace("joints: {every_m: 3", "joints: {every_m: 4"),
            "track.yaml has changed",
        ),
    ] {
        let good = dir.read(file);
        dir.write(file, text.as_bytes());
        let told = dir.refused(&["study", "spread.yaml"]);
        assert!(told.contains(what) && told.contains("--out"), "{told}");
        assert_eq!(dir.read(RESULTS), before);
        dir.write(file, good.as_bytes());
    }
    assert_eq!(dir.monorig(&["study", "spread.yaml"]).0, Some(0));
}

/// Draws stand in the results, and another variable leaves them as they were.
#[test]
fn a_further_variable_changes_no_other_draw() {
    let draws = |study: &str| {
        let dir = dir(study);
        let (code, _, err) = dir.monorig(&["study", "spread.yaml"]);
        assert_eq!(code, Some(0), "{err}");
        let lines = dir.read(RESULTS);
        let of =
            |line: &str| serde_json::from_str::<serde_json::Value>(line).unwrap()["draws"].clone();
        lines.lines().skip(1).map(of).collect::<Vec<_>>()
    };
    let all = STUDY.replace("runs: 200", "runs: 5");
    let fewer = all.replace("  - {path: load.mass_kg, uniform: [0, 2500]}\n", "");
    let (all, fewer) = (draws(&all), draws(&fewer));
    for (a, b) in all.iter().zip(&fewer) {
        assert!(
            a["load.mass_kg"]
                .as_f64()
                .is_some_and(|kg| (0.0..2500.0).contains(&kg))
        );
        assert!(b.get("load.mass_kg").is_none());
        for (path, value) in b.as_object().unwrap() {
            assert_eq!(&a[path], value, "{path}");
        }
    }
    assert_ne!(all[0], all[1]);
}

/// A draw that cannot be used is the failure of its run; the study goes on and is red.
#[test]
fn a_run_that_cannot_be_made_is_its_own_failure() {
    let study = STUDY
        .replace("runs: 200", "runs: 12")
        .replace("[0, 2500]", "[0, 3200]");
    let dir = dir(&study);
    let (code, out, err) = dir.monorig(&["study", "spread.yaml"]);
    assert_eq!(code, Some(1), "{out}{err}");
    assert!(
        out.contains("FAILED: the run: ") && out.contains("cannot carry a load"),
        "{out}"
    );
    assert_eq!(dir.read(RESULTS).lines().count(), 13);
}

#[test]
fn bad_studies_are_refused() {
    for (good, bad, says) in [
        (
            "runs: 200",
            "runs: 0",
            "runs: 0 runs cannot be made from seed 11",
        ),
        ("runs: 200", "rums: 200", "unknown key `rums`"),
        ("why: A spread.", "why: ''", "needs a purpose"),
        (
            "uniform: [0, 2500]",
            "uniform: [5, 5]",
            "vary[0]: no value lies between 5 and 5",
        ),
        ("uniform: [0, 2500]", "sd: 3", "unknown key `sd`"),
        (
            "load.mass_kg, uniform: [0, 2500]",
            "load.mass_kg",
            "exactly one distribution",
        ),
        (
            "path: load.mass_kg",
            "path: record.rate_hz",
            "`record.rate_hz` is changed twice",
        ),
        (
            "path: load.mass_kg",
            "path: load.mas_kg",
            "(given as load.mas_kg = ",
        ),
        (
            "running_wheel, log",
            "running_weel, log",
            "(given as train.resistance.running_weel = ",
        ),
        (
            "scenario: quick.yaml",
            "scenario: quik.yaml",
            "does not exist",
        ),
    ] {
        let dir = dir(&STUDY.replace(good, bad));
        let told = dir.refused(&["study", "spread.yaml"]);
        assert!(told.contains(says), "{bad}\n{told}");
        let told = dir.refused(&["check", "--kind", "study", "spread.yaml"]);
        assert!(told.contains(says), "{bad}\n{told}");
    }
    let dir = dir(STUDY);
    assert_eq!(
        dir.monorig(&["check", "spread.yaml"]).1,
        "spread.yaml: study ok\n"
    );
    let told = dir.refused(&["study", "spread.yaml", "--shard", "5/4"]);
    assert!(told.contains("K from 1 to N"), "{told}");
}

/// A grid has every combination once, each with the seeds of the scenario, and its table and page have a row and a
/// place for each; a run of it is the run of the scenario with these values.
#[test]
fn a_grid_of_values_is_gone_through() {
    let dir = dir(STUDY);
    let vary = [
        "--vary",
        "load.mass_kg=500..2500:3",
        "--vary",
        "physics.dt_ms=1,2",
    ];
    let task = [
        &["study", "quick.yaml", "--seeds", "3..4", "--json", "s.json"],
        &vary[..],
    ]
    .concat();
    let (code, out, err) = dir.monorig(&task);
    assert!(matches!(code, Some(0 | 1)), "{out}{err}");
    let json: serde_json::Value = serde_json::from_str(&dir.read("s.json")).unwrap();
    let results = json["results"].as_str().unwrap();
    let lines = dir.read(results);
    let rows: Vec<serde_json::Value> = lines
        .lines()
        .skip(1)
        .map(|l| serde_json::from_str(l).unwrap())
        .collect();
    let of = |row: &serde_json::Value| {
        let [mass, step] =
            ["load.mass_kg", "physics.dt_ms"].map(|k| row["draws"][k].as_f64().unwrap());
        (mass as u64, step as u64, row["seed"].as_u64().unwrap())
    };
    let made: std::collections::BTreeSet<_> = rows.iter().map(of).collect();
    let all = [500, 1500, 2500].map(|m| [1, 2].map(|dt| [3, 4].map(|seed| (m, dt, seed))));
    assert_eq!(made, all.into_iter().flatten().flatten().collect());
    assert_eq!(rows.len(), 12);
    for part in ["500, 1 ", "2500, 2 ", "rail_fusion"] {
        assert!(out.contains(part), "{part}\n{out}");
    }
    assert_eq!(json["points"].as_array().unwrap().len(), 6);

    let sets = [
        "--set",
        "load.mass_kg=1500",
        "--set",
        "physics.dt_ms=2",
        "--json",
        "t.json",
    ];
    dir.monorig(&[&["test", "quick.yaml", "--seeds", "4"][..], &sets].concat());
    let one: serde_json::Value = serde_json::from_str(&dir.read("t.json")).unwrap();
    let there = rows.iter().find(|row| of(row) == (1500, 2, 4)).unwrap();
    let summary = &one["scenarios"][0]["runs"][0]["summary"];
    assert!(summary["estimators"].is_object());
    assert_eq!(summary["estimators"], there["summary"]["estimators"]);

    let (code, _, err) = dir.monorig(&["report", results, "--out", "s.html"]);
    assert_eq!(code, Some(0), "{err}");
    assert!(dir.read("s.html").contains("over load.mass_kg"));
    for (vary, says) in [
        ("load.mas_kg=1,2", "did you mean `mass_kg`"),
        ("load.mass_kg=1..2", "FROM..TO:COUNT"),
        ("load.mass_kg=1..2:1", "FROM..TO:COUNT"),
        ("load.mass_kg=", "FROM..TO:COUNT"),
    ] {
        let told = dir.refused(&["study", "quick.yaml", "--vary", vary]);
        assert!(told.contains(says), "{vary}: {told}");
    }
    let told = dir.refused(&["study", "spread.yaml", "--set", "record.rate_hz=5"]);
    assert!(told.contains("need --vary"), "{told}");
}
