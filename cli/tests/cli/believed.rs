//! Nothing is believed because a file says so: names in manifests, edited manifests, lines of results, verdicts.

use crate::common::{TestFolder, words};
use monorig_testing::Random;
use monorig_testing::mutants;
use serde_json::Value;

const QUICK: &str = "\
version: 1
why: A quick one.
track: track.yaml
train: train.yaml
start: {chainage_m: 2}
stop: {after_s: 12}
physics: {plant: point-mass}
drive: {speed: [{at_s: 0, mps: 0}, {at_s: 3, mps: 1.5}]}
sensors: sensors.yaml
estimators: {attitude: {}}
integrity: {max_misleading_share: 1}
seeds: 1..3
expect: [{metric: speed_rmse_mps, at_most: 1}]
";

fn quick() -> TestFolder {
    let dir = TestFolder::new();
    dir.write("quick.yaml", QUICK.as_bytes());
    dir
}

/// Paths of all leaves of a tree, and of its lists and mappings that are empty.
fn leaves(tree: &Value, path: &str, all: &mut Vec<String>) {
    match tree {
        Value::Object(map) if !map.is_empty() => {
            for (key, value) in map {
                let key = key.replace('~', "~0").replace('/', "~1");
                leaves(value, &format!("{path}/{key}"), all);
            }
        }
        Value::Array(list) if !list.is_empty() => {
            for (i, value) in list.iter().enumerate() {
                leaves(value, &format!("{path}/{i}"), all);
            }
        }
        _ => all.push(path.to_owned()),
    }
}

/// Another value of the same kind.
fn other(value: &Value, random: &mut Random) -> Value {
    match value {
        Value::Bool(flag) => Value::Bool(!flag),
        Value::Number(n) => serde_json::json!(n.as_f64().unwrap_or(0.0) * 1.5 + 1.0),
        Value::String(text) => {
            let ends = ["x", "/../y", "0", " "];
            Value::String(format!("{text}{}", random.of(&ends)))
        }
        _ => serde_json::json!("something"),
    }
}

/// A leaf of the tree edited; which one.
fn edited(tree: &Value, random: &mut Random) -> (Value, String) {
    let mut all = Vec::new();
    leaves(tree, "", &mut all);
    let path = random.of(&all).clone();
    let mut tree = tree.clone();
    let leaf = tree.pointer_mut(&path).unwrap();
    *leaf = other(leaf, random);
    (tree, path)
}

/// Whatever is edited in a manifest, `check` finds it, and nothing is made of the run.
#[test]
fn an_edited_manifest_is_found() {
    let dir = quick();
    let (code, out, err) = dir.monorig(&["run", "quick.yaml", "--keep-samples", "--no-rerun"]);
    assert_eq!(code, Some(0), "{out}{err}");
    let (folder, file) = ("runs/quick/1", "runs/quick/1/manifest.json");
    let good = dir.read(file);
    let (code, out, err) = dir.monorig(&["check", file]);
    assert_eq!(code, Some(0), "{out}{err}");
    let tree: Value = serde_json::from_str(&good).unwrap();
    let mut random = Random::new(mutants::first_seed());
    for _ in 0..mutants::count(12) {
        let (bad, path) = edited(&tree, &mut random);
        dir.write(file, serde_json::to_string_pretty(&bad).unwrap().as_bytes());
        let (code, out, err) = dir.monorig(&["check", file]);
        assert_eq!(code, Some(2), "{path}: {out}{err}");
    }
    let elsewhere = dir.path("").join("elsewhere").display().to_string();
    for (path, value) in [
        ("/scenario", "../../outside"),
        ("/scenario", &elsewhere),
        ("/scenario", "other"),
        ("/monorig/program", "0000"),
        ("/inputs/quick.yaml", "0000"),
        ("/outputs/metrics.json", "0000"),
    ] {
        let mut bad = tree.clone();
        *bad.pointer_mut(path).unwrap() = value.into();
        dir.write(file, serde_json::to_string_pretty(&bad).unwrap().as_bytes());
        dir.write("mine.csv", b"t,mass_kg\n0,1\n1,1\n");
        for command in [
            &["check", file][..],
            &["report", folder],
            &["explain", folder, "--seeds", "1"],
            &["export", folder, "--to", "csv", "--out", "made/log"],
            &[
                "judge",
                folder,
                "--estimates",
                "mine.csv",
                "--out",
                "made/runs",
            ],
            &["map", folder, "--out", "made.yaml"],
        ] {
            dir.refused(command);
        }
        let (_, out, _) = dir.monorig(&["runs"]);
        assert!(out.contains("damaged"), "{path}: {out}");
    }
    for made in ["outside", "made/log", "made/runs", "made.yaml"] {
        assert!(!dir.path(made).exists(), "{made}");
    }
    assert!(!std::path::Path::new(&elsewhere).exists());
    dir.write(file, good.as_bytes());
    let (code, out, err) = dir.monorig(&["report", folder]);
    assert_eq!(code, Some(0), "{out}{err}");
}

/// A line of results is of its study: a shard of another seed, another scenario, other draws, or with a verdict that
/// does not follow from its value is refused by `merge` and `report`.
#[test]
fn an_edited_line_of_results_is_found() {
    let dir = quick();
    dir.write(
        "study.yaml",
        b"version: 1\nwhy: Some.\nscenario: quick.yaml\nruns: 4\nvary: [{path: load.mass_kg, uniform: [100, 2000]}]\n",
    );
    for shard in ["1/2", "2/2"] {
        let (code, out, err) = dir.monorig(&["study", "study.yaml", "--shard", shard]);
        assert!(matches!(code, Some(0 | 1)), "{out}{err}");
    }
    let shards = [
        "runs/study/results.1-of-2.jsonl",
        "runs/study/results.2-of-2.jsonl",
    ];
    let merge = ["merge", shards[0], shards[1], "--into", "all.jsonl"];
    let (code, out, err) = dir.monorig(&merge);
    assert!(matches!(code, Some(0 | 1)), "{out}{err}");
    let good = dir.read(shards[1]);
    let lines: Vec<&str> = good.lines().collect();
    let tree: Value = serde_json::from_str(lines[1]).unwrap();
    for path in [
        "/index",
        "/seed",
        "/scenario",
        "/draws/load.mass_kg",
        "/summary/seed",
        "/summary/scenario",
        "/summary/expectations/0/held",
        "/summary/finished",
    ] {
        let mut bad = tree.clone();
        let leaf = bad.pointer_mut(path).unwrap();
        *leaf = match leaf.as_u64() {
            Some(n) => (n + 1).into(),
            None => other(leaf, &mut Random::new(1)),
        };
        let text = [lines[0], &bad.to_string(), lines[2]].join("\n") + "\n";
        dir.write(shards[1], text.as_bytes());
        dir.refused(&merge);
        dir.refused(&["report", shards[1]]);
    }
}

/// Exit code, JUnit, JSON, HTML and the list of runs say the same, whatever the scenario expects; and exit code 1 has a
/// reason on standard output.
#[test]
fn all_reports_of_a_run_say_the_same() {
    let dir = quick();
    let mut random = Random::new(mutants::first_seed());
    for case in 0..mutants::count(6) {
        let metric = *random.of(&["speed_rmse_mps", "off_rail_max_m", "accel_rms_mps2"]);
        let bound = 10f64.powi(random.below(9) as i32 - 6);
        let side = *random.of(&["at_most", "at_least"]);
        let known = match random.below(3) {
            0 => format!(
                "known_failures: [{{metric: {metric}, why: a test, no_worse_than: {:e}}}]\n",
                2.0 * bound
            ),
            1 => format!(
                "known_failures: [{{metric: {metric}, why: a test, no_worse_than: {bound:e}}}]\n"
            ),
            _ => String::new(),
        };
        let text = QUICK
            .replace(
                "metric: speed_rmse_mps, at_most: 1",
                &format!("metric: {metric}, {side}: {bound:e}"),
            )
            .replace("seeds: 1..3", "seeds: 1");
        dir.write("quick.yaml", (text.clone() + &known).as_bytes());
        let words = |out: &str| format!("case {case}: {text}{known}{out}");
        let (run, out, err) = dir.monorig(&["run", "quick.yaml", "--no-rerun"]);
        assert!(matches!(run, Some(0 | 1)), "{}{err}", words(&out));
        if run == Some(1) {
            assert!(out.contains("FAILED"), "{}", words(&out));
        }
        let (_, listed, _) = dir.monorig(&["runs"]);
        let held = listed.contains("held with weakened limits");
        assert!(held != listed.contains("FAILED"), "{listed}");
        assert_eq!(held, run == Some(0), "{}{listed}", words(&out));
        dir.monorig(&["report", "runs/quick/1"]);
        let page = dir.read("runs/quick/1/report.html");
        assert_eq!(
            page.contains("held with weakened limits"),
            held,
            "{}",
            words(&out)
        );
        let reports = ["--junit", "v.xml", "--json", "v.json"];
        let (test, out, _) = dir.monorig(&[&["test", "quick.yaml"], &reports[..]].concat());
        let (xml, json) = (dir.read("v.xml"), dir.read("v.json"));
        let red = xml.contains("<failure");
        assert_eq!(test, Some(i32::from(red)), "{}{xml}", words(&out));
        let json: Value = serde_json::from_str(&json).unwrap();
        let held_there = &json["scenarios"][0]["held"];
        assert_eq!(held_there, !red, "{}{json}", words(&out));
        assert_eq!(out.contains("FAILED"), red, "{}", words(&out));
        dir.monorig(&["report", "v.json"]);
        assert_eq!(dir.read("v.html").contains("FAILED"), red);
        // a known failure may hold in a run, and not over all seeds
        assert!(red || held, "{}", words(&out));
    }
}

/// A baseline that is far better fails every report; one that shares nothing is refused.
#[test]
fn a_baseline_is_in_every_report() {
    let dir = quick();
    let json = ["--json", "before.json"];
    let (code, out, err) =
        dir.monorig(&[&["test", "quick.yaml", "--seeds", "1"], &json[..]].concat());
    assert_eq!(code, Some(0), "{out}{err}");
    // worse instruments
    let sheet = dir
        .read("sensors.yaml")
        .replace("noise_sd: 0.005", "noise_sd: 0.2");
    dir.write("sensors.yaml", sheet.as_bytes());
    let against = [
        "test",
        "quick.yaml",
        "--baseline",
        "before.json",
        "--junit",
        "v.xml",
        "--json",
        "v.json",
    ];
    let (code, out, err) = dir.monorig(&against);
    assert_eq!(code, Some(1), "{out}{err}");
    assert!(
        words(&out).contains("not worse than the baseline") || out.contains("worse: "),
        "{out}"
    );
    assert!(dir.read("v.xml").contains("<failure"));
    let verdicts: Value = serde_json::from_str(&dir.read("v.json")).unwrap();
    assert_eq!(verdicts["scenarios"][0]["held"], false);
    dir.monorig(&["report", "v.json"]);
    assert!(dir.read("v.html").contains("FAILED"));
    let other = [&against[..], &["--seeds", "7"]].concat();
    let (code, _, err) = dir.monorig(&other);
    assert!(
        code == Some(2) && err.contains("nothing to compare"),
        "{err}"
    );
}
